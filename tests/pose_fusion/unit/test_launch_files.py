"""The shipped launch files: they evaluate, and their parameters are the nodes' own."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory

from imu_bridge.parameters import ImuBridgeParameters
from kinect_bridge.parameters import KinectBridgeParameters
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.parameters import from_mapping, from_ros_yaml, specs
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.recording.parameters import RecorderParameters
from pose_launch.evaluation import LaunchEvaluation
from pose_view.parameters import ViewParameters

SRC = Path(__file__).resolve().parents[3] / "src"
FILES = sorted(SRC.glob("*/launch/*.launch.yaml"))
GIVEN = {"recording": "r.csv", "file": "r.csv", "session": "/s", "start_at": "12"}
PANDA = str(SRC / "pose_teleop/config/panda.yaml")
PARAMETERS = {
    "kinect_bridge": KinectBridgeParameters,
    "imu_bridge": ImuBridgeParameters,
    "calibration": LiveCalibrationParameters,
    "fusion": FusionNodeParameters,
    "recorder": RecorderParameters,
    "viewer": ViewParameters,
}


@dataclass(frozen=True)
class NoParameters:
    """Of a node that is not looked at."""


def nodes_of(actions):
    for action in actions:
        ((kind, element),) = action.items()
        if kind == "group":
            yield from nodes_of(element["children"])
        elif kind == "node" and "param" in element:
            yield element


def evaluate(file, **given):
    declared = LaunchEvaluation({}, describe=True).run(file).arguments
    required = {a.name: GIVEN[a.name] for a in declared if a.default is None}
    switches = {a.name: "true" for a in declared if a.default in ("true", "false")}
    return LaunchEvaluation({**switches, **required, **given}).run(file)


def installed(file):
    """Where it is installed: its includes are found from there too."""
    package = file.parents[1].name
    return Path(get_package_share_directory(package)) / "launch" / file.name


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_launch_file_evaluates_with_its_required_arguments(file):
    assert evaluate(installed(file)).processes


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_parameters_of_a_launch_file_exist_in_its_nodes(file):
    for process in evaluate(installed(file)).processes:
        if not process.is_node:
            continue
        parameters = PARAMETERS.get(Path(process.command[0]).name)
        if parameters is None:
            continue  # tele-operation's, which its own tests hold
        for source in process.parameters:
            if isinstance(source, Path):
                from_ros_yaml(parameters, source, process.name)
                assert process.name in source.read_text() or "/**" in source.read_text()
            else:
                own = {k: v for k, v in source.items() if k not in ("use_sim_time", "autostart")}
                from_mapping(parameters, own)


def ordered(process):
    """A node's parameters, if later sources override earlier ones; those not of a file alone."""
    values, own = {}, set()
    for source in process.parameters:
        if isinstance(source, Path):
            source = yaml.safe_load(source.read_text())["/**"]["ros__parameters"]
        else:
            own |= set(source)
        values.update(source)
    return {name: values[name] for name in own}


@pytest.mark.parametrize(
    ("file", "given"),
    [
        ("pose_fusion/launch/fusion.launch.yaml", {"sensors": "[a, b]", "estimator": "li2020"}),
        ("pose_view/launch/view.launch.yaml", {"sensors": "[a, b]"}),
        ("pose_teleop/launch/teleop.launch.yaml", {"side": "left", "arm_params": PANDA}),
        ("imu_bridge/launch/imu.launch.yaml", {"magnetometer": "off"}),
    ],
)
@pytest.mark.parametrize("namespace", [None, "/operator_1"])
@pytest.mark.usefixtures("ros_context")
def test_arguments_of_a_launch_file_override_parameter_files(file, given, namespace, tmp_path):
    for process in evaluate(installed(SRC / file), **given).processes:
        if not any(isinstance(source, Path) for source in process.parameters):
            continue
        command = replace(process, namespace=namespace).full_command(tmp_path)
        node = rclpy.create_node(
            process.name,
            cli_args=command[command.index("--ros-args") :],
            automatically_declare_parameters_from_overrides=True,
        )
        expected = ordered(process)
        found = {name: node.get_parameter(name).value for name in expected}
        node.destroy_node()
        assert found == expected


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_string_parameters_stay_strings(file):
    """YAML takes ``off`` for false and ``5`` for a number, unless ``type`` says what it is."""
    for node in nodes_of(yaml.safe_load(file.read_text())["launch"]):
        texts = [
            name
            for name, (default, _) in specs(PARAMETERS.get(node["exec"], NoParameters)).items()
            if isinstance(default, str)
        ]
        for part in node["param"]:
            if part.get("name") in texts and "$(" in part["value"]:
                assert part.get("type") == "str", part


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_launch_argument_has_a_description(file):
    assert all(
        argument.description for argument in LaunchEvaluation({}, describe=True).run(file).arguments
    )


def test_numeric_names_stay_strings():
    graph = evaluate(installed(SRC / "pose_fusion/launch/capture.launch.yaml"), sensor_left="0")

    kinect = next(process for process in graph.processes if process.name == "kinect_left")
    assert kinect.parameters[-1]["sensor"] == "0"
    assert isinstance(kinect.parameters[-1]["start_at"], str)


@pytest.mark.parametrize(
    "sensors",
    ["[left]", "[left,right]", "[left, right, back]", "[a, b, c, d, e, f]"],
)
def test_one_launch_file_starts_one_or_several_cameras(sensors):
    graph = evaluate(installed(SRC / "pose_fusion/launch/capture.launch.yaml"), sensors=sensors)
    names = sensors.strip("[]").replace(" ", "").split(",")

    bridges = [process for process in graph.processes if process.name.startswith("kinect_")]
    assert [bridge.parameters[-1]["name"] for bridge in bridges] == names
    assert [bridge.parameters[-1]["sensor"] for bridge in bridges] == [
        str(number) for number in range(len(names))
    ]
    for name in ("calibration", "fusion"):
        (process,) = (each for each in graph.processes if each.name == name)
        assert process.parameters[-1]["sensors"] == names


@pytest.mark.parametrize(
    ("given", "expected"), [({}, None), ({"estimator": "li2020"}, "li2020")], ids=["not", "given"]
)
def test_the_estimator_of_the_params_file_is_overridden_only_if_one_is_given(given, expected):
    graph = evaluate(installed(SRC / "pose_fusion/launch/fusion.launch.yaml"), **given)

    (fusion,) = [process for process in graph.processes if process.name == "fusion"]
    values = [source for source in fusion.parameters if not isinstance(source, Path)]
    given_estimators = [value["estimator"] for value in values if "estimator" in value]
    assert given_estimators == ([expected] if expected else [])


@pytest.mark.parametrize(
    ("file", "nodes"),
    [
        ("pose_fusion/launch/fusion.launch.yaml", {"calibration", "fusion", "recorder"}),
        ("pose_view/launch/view.launch.yaml", {"fusion_kinect", "fusion_imu", "viewer"}),
        ("pose_teleop/launch/teleop.launch.yaml", {"arm", "simulated_robot"}),
    ],
)
def test_simulated_time_is_passed_to_every_node_that_reads_the_clock(file, nodes):
    processes = evaluate(installed(SRC / file), use_sim_time="true").processes

    simulated = {
        process.name
        for process in processes
        for source in process.parameters
        if isinstance(source, dict) and source.get("use_sim_time") is True
    }
    assert simulated == nodes


def test_both_kinects_have_the_same_start_time():
    graph = evaluate(installed(SRC / "pose_fusion/launch/sensors.launch.yaml"))

    starts = {p.parameters[-1]["start_at"] for p in graph.processes if "kinect" in p.name}
    assert len(starts) == 1
    assert starts.pop().isdigit()


def test_the_services_of_the_containers_start_launch_files_with_arguments_they_have():
    compose = yaml.safe_load((SRC.parent / "docker" / "compose.yaml").read_text())

    for service in compose["services"].values():
        verb, name, *words = service["command"]
        (file,) = SRC.glob(f"*/launch/{name}")
        declared = {
            a.name for a in LaunchEvaluation({}, describe=True).run(installed(file)).arguments
        }
        assert verb == "up"
        assert {word.split(":=")[0] for word in words} <= declared


def test_the_services_have_no_rights_and_open_no_port_but_the_page_s_on_the_loopback():
    compose = yaml.safe_load((SRC.parent / "docker" / "compose.yaml").read_text())

    assert set(compose["services"]) == {"sensor-host", "fusion-host", "viewer", "tele-operation"}
    for service in compose["services"].values():
        assert service["user"] == "10001"
        assert service["read_only"] is True
        assert service["cap_drop"] == ["ALL"]
        assert "ports" not in service
        discovery = service["environment"]["ROS_AUTOMATIC_DISCOVERY_RANGE"]
        assert discovery == "${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
        assert not any(word.startswith("host:=") for word in service["command"])


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, ""),
        ({"extrinsics_file": "s.yaml"}, "s.yaml"),
        ({"extrinsics_file": "s.yaml", "imus_file": "i.yaml"}, "i.yaml"),
    ],
)
def test_the_fusion_reads_imu_alignments_from_the_sessions_file(given, expected):
    graph = evaluate(installed(SRC / "pose_fusion/launch/fusion.launch.yaml"), **given)

    (fusion,) = [process for process in graph.processes if process.name == "fusion"]
    values = [source for source in fusion.parameters if not isinstance(source, Path)]
    assert [value["imus_file"] for value in values if "imus_file" in value] == [expected]
