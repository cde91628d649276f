import pytest
from readme_tables import SRC, generated_part, markdown_table

from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.parameters import from_mapping, values_from_ros_yaml
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.recording.parameters import PlayerParameters, RecorderParameters

NODES = {
    "fusion": FusionNodeParameters,
    "calibration": LiveCalibrationParameters,
    "imu_calibration": ImuCalibrationParameters,
    "recorder": RecorderParameters,
    "player": PlayerParameters,
}


@pytest.mark.parametrize("node", NODES)
def test_the_readmes_parameters_are_those_of_the_node(node):
    assert generated_part("pose_fusion", f"parameters: {node}") == markdown_table(NODES[node])


@pytest.mark.parametrize("node", ["fusion", "calibration"])
def test_config_files_set_only_valid_parameters(node):
    values = values_from_ros_yaml(SRC / "pose_fusion" / "config" / f"{node}.yaml", node)
    assert values
    from_mapping(NODES[node], values)
