"""Our nodes through the transitions of the lifecycle, and numbers where numbers are declared."""

import math
import os
import tty
from pathlib import Path

import pytest
from pose_msgs.msg import SkeletonArray
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from synthetic_body import extrinsics

from imu_bridge.nodes.imu_bridge import ImuBridge
from imu_bridge.parameters import ImuBridgeParameters
from kinect_bridge.nodes.kinect_bridge import KinectBridge
from kinect_bridge.parameters import KinectBridgeParameters
from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.errors import InputError
from pose_core.parameters import specs
from pose_fusion.nodes.calibration import CalibrationNode
from pose_fusion.nodes.recorder import Recorder
from pose_fusion.parameters import FusionNodeParameters
from pose_fusion.recording.parameters import PlayerParameters, RecorderParameters
from pose_node.nodes.declaring import declare_parameters
from pose_view.parameters import ViewParameters

CSV = Path(__file__).parents[2] / "kinect_bridge" / "data" / "two_sensors.csv"
SUCCESS = TransitionCallbackReturn.SUCCESS


@pytest.fixture
def serial_device():
    master, slave = os.openpty()
    tty.setraw(slave)
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


@pytest.fixture
def make(ros_context, tmp_path, serial_device):
    """Make a node by its name, with what it needs."""
    nodes_file = tmp_path / "nodes.yaml"
    nodes_file.write_text("nodes: {1: torso}")
    kinds = {
        "kinect_bridge": (KinectBridge, {"file": str(CSV), "loop": True}),
        "imu_bridge": (ImuBridge, {"port": serial_device, "nodes_file": str(nodes_file)}),
        "calibration": (CalibrationNode, {}),
        "recorder": (Recorder, {"output": str(tmp_path / "bag"), "all": True}),
    }

    def make(name, **values):
        kind, needed = kinds[name]
        given = {**needed, **values}
        return ros_context.add(
            kind(parameter_overrides=[Parameter(n, value=v) for n, v in given.items()])
        )

    return make


NODES = ("kinect_bridge", "imu_bridge", "calibration", "recorder")


@pytest.mark.parametrize("name", NODES)
def test_a_node_passes_its_lifecycle_twice(make, name):
    node = make(name, autostart=False)
    assert not node.is_active
    before = len(list(node.timers)), len(list(node.subscriptions)), len(list(node.services))

    for _ in range(2):
        assert node.trigger_configure() is SUCCESS
        for _ in range(2):
            assert node.trigger_activate() is SUCCESS
            assert node.is_active
            assert node._report().message
            assert node.trigger_deactivate() is SUCCESS
        assert node.trigger_cleanup() is SUCCESS

    after = len(list(node.timers)), len(list(node.subscriptions)), len(list(node.services))
    assert after == before


def test_a_deactivated_camera_publishes_nothing_and_restarts_when_activated(
    ros_context, spin_until, make
):
    received = ros_context.collect(SkeletonArray, "kinect_left/skeletons", qos_profile_sensor_data)
    node = make("kinect_bridge")
    spin_until(lambda: len(received) > 3, what="frames")

    node.trigger_deactivate()
    waiting = ros_context.make_node("waiting")
    ticks = []
    waiting.create_timer(0.1, lambda: ticks.append(len(received)))
    spin_until(lambda: len(ticks) > 5, what="some time")
    before = ticks[-1]
    assert before == ticks[2]

    node.trigger_activate()
    spin_until(lambda: len(received) > before + 3, what="frames again")


def test_a_deactivated_calibration_keeps_its_result(make, tmp_path):
    save_extrinsics(tmp_path / "extrinsics.yaml", extrinsics())
    node = make("calibration", file=str(tmp_path / "extrinsics.yaml"))
    known = node.calibration.extrinsics
    (tmp_path / "extrinsics.yaml").unlink()

    node.trigger_deactivate()
    node.trigger_activate()

    assert node.calibration.extrinsics is known


def test_a_calibration_keeps_its_result_when_time_restarts(make, tmp_path):
    save_extrinsics(tmp_path / "extrinsics.yaml", extrinsics())
    node = make("calibration", file=str(tmp_path / "extrinsics.yaml"))
    known = node.calibration.extrinsics

    node.restart_time()

    assert node.calibration.extrinsics is known
    assert node.calibration.is_finished


def test_each_activation_of_the_recorder_writes_a_new_bag(make, tmp_path):
    node = make("recorder")
    node.trigger_deactivate()
    node.trigger_activate()
    assert node._recording is not None
    node.trigger_deactivate()
    assert node._recording is None


def test_configuring_reports_an_invalid_file(make):
    node = make("kinect_bridge", autostart=False, file="nowhere.csv")

    assert node.trigger_configure() is not SUCCESS
    assert "nowhere.csv" in node._report().message
    with pytest.raises(InputError):
        make("kinect_bridge", file="nowhere.csv")


@pytest.mark.parametrize(
    "parameters",
    [
        FusionNodeParameters,
        ImuBridgeParameters,
        KinectBridgeParameters,
        LiveCalibrationParameters,
        PlayerParameters,
        RecorderParameters,
        ViewParameters,
    ],
)
def test_every_number_may_be_given_as_an_integer(ros_context, parameters):
    """At the start (``-p``, a file, a launch argument) and by ``ros2 param set``."""
    known = specs(parameters)
    numbers = {name: spec for name, (default, spec) in known.items() if isinstance(default, float)}
    integers = {name: an_integer(spec) for name, spec in numbers.items()}
    given = {name: value for name, value in integers.items() if value is not None}
    overrides = [Parameter(name, value=value) for name, value in given.items()]
    node = ros_context.make_node("numbers", parameter_overrides=overrides)

    values = declare_parameters(node, parameters, changeable=known)

    for name, value in given.items():
        assert type(getattr(values, name)) is float
        assert getattr(values, name) == value
        (result,) = node.set_parameters([Parameter(name, value=value)])
        assert result.successful, f"{name}: {result.reason}"
        assert node.get_parameter(name).type_ is Parameter.Type.DOUBLE


def an_integer(spec):
    """One that is allowed, None if none is."""
    low, high = spec.limits or (0.0, math.inf)
    return math.ceil(low) if math.ceil(low) <= high else None
