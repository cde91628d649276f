from pathlib import Path

from readme_tables import generated_part, joints_table, markdown_table

from kinect_bridge.parameters import KinectBridgeParameters
from pose_core.parameters import from_mapping, values_from_ros_yaml
from pose_io.recordings.formats import FORMATS, plain_csv
from pose_io.recordings.joint_map_files import SHIPPED, shipped_joint_map

PACKAGE = Path(__file__).parents[3] / "src" / "kinect_bridge"
README = (PACKAGE / "README.md").read_text()

SHOWN = (
    "kinect_v1",
    "kinect_v2",
    "azure_kinect",
    "nite2",
    "mediapipe",
    "smpl_24",
    "zed_18",
    "zed_34",
    "zed_38",
)


def test_the_parameters_are_those_of_the_node():
    assert generated_part("kinect_bridge", "parameters") == markdown_table(KinectBridgeParameters)


def test_the_joints_are_those_of_the_maps():
    assert generated_part("kinect_bridge", "joints") == joints_table(map(shipped_joint_map, SHOWN))


def test_every_shipped_map_is_named():
    assert all(f"`{name}`" in README for name in SHIPPED)


def test_every_format_and_fixed_column_is_described():
    for name in FORMATS:
        assert f"`{name}`" in README
    for column in plain_csv.COLUMNS[:4]:
        assert f"`{column}`" in README


def test_the_example_sets_every_parameter_to_something_allowed():
    values = values_from_ros_yaml(PACKAGE / "config" / "kinect_bridge.yaml", "kinect_bridge")

    assert set(values) == set(vars(KinectBridgeParameters()))
    from_mapping(KinectBridgeParameters, values)
