"""``demo`` as a user runs it: real processes, a live graph, a bag."""

import csv
import math
import re
from pathlib import Path

import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from patience import PATIENCE_S

from pose_core.body.joint_angles import ANGLES
from pose_core.joints import JOINTS
from pose_io.bags import open_bag
from pose_node.child_process import executable

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]

RVIZ_TYPES = {
    "rviz_default_plugins/RobotModel": "std_msgs/msg/String",
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
}


@pytest.fixture(scope="module")
def demo():
    return executable("pose_fusion", "demo")


@pytest.fixture(scope="module")
def synthetic(start_module_process, demo, tmp_path_factory):
    """One short run that several tests look at: (process, folder)."""
    folder = tmp_path_factory.mktemp("demo") / "run"
    process = start_module_process([demo, "--duration", "20", "-o", folder])
    process.wait(2.0 * PATIENCE_S)
    return process, folder, start_module_process


def values(path, quantity):
    with path.open() as lines:
        return {
            (row["method"], row["of"]): float(row["value"] or "nan")
            for row in csv.DictReader(lines)
            if row["quantity"] == quantity
        }


def test_a_synthetic_run_succeeds_and_leaves_no_process(synthetic):
    process, _, starter = synthetic
    assert process.returncode == 0, process.describe()
    assert starter.living() == []


def test_a_synthetic_run_says_that_it_is_synthetic(synthetic):
    process, _, _ = synthetic
    assert "Synthetic subject" in process.output
    assert "simulated sensors" in process.output


def test_every_method_is_compared_with_the_truth_in_every_angle(synthetic):
    _, folder, _ = synthetic
    rmse = values(folder / "report" / "evaluation.csv", "rmse")
    methods = ("left", "right", "mean", "fused")
    assert set(rmse) == {(method, angle) for method in methods for angle in ANGLES}
    # A wrong sign, side or frame gives far more.
    assert all(math.isfinite(error) and error < 60.0 for error in rmse.values())


def test_another_program_decodes_every_topic_by_the_definitions_in_the_bag(synthetic):
    _, folder, _ = synthetic
    factory, decoded = DecoderFactory(), {}
    with next((folder / "bag").glob("*.mcap")).open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic not in decoded:
                decode = factory.decoder_for(channel.message_encoding, schema)
                decoded[channel.topic] = decode(message.data)
    assert decoded["/kinect_left/skeletons"].header.frame_id == "kinect_left_optical_frame"
    assert "/humans/bodies/subject/estimate" in decoded
    assert "/imu_left_shank/data" in decoded


def test_every_topic_of_the_rviz_and_foxglove_layouts_was_published(synthetic):
    _, folder, _ = synthetic
    share = Path(get_package_share_directory("pose_fusion"))
    rviz = yaml.safe_load((share / "rviz" / "pose.rviz").read_text())
    shown = {
        display.get("Topic", display.get("Description Topic"))["Value"]: RVIZ_TYPES[
            display["Class"]
        ]
        for display in rviz["Visualization Manager"]["Displays"]
        if display["Class"] in RVIZ_TYPES
    }
    assert len(shown) == len(RVIZ_TYPES)
    layout = (share / "foxglove" / "pose.json").read_text()
    named = set(re.findall(r'"(/(?:humans|diagnostics)[a-z_/]*)', layout))
    fields = re.findall(r'"value": "(/[^."]+)[.]([a-z]+)', layout)

    with open_bag(folder / "bag") as bag:
        types = {name: topic.msgtype for name, topic in bag.topics.items() if topic.count}
        first = {message.topic: message for message in bag.messages({t for t, _ in fields})}
        messages = {topic: bag.deserialize(message) for topic, message in first.items()}
    assert shown.items() <= types.items()
    assert {"/tf", "/tf_static"} | named <= set(types)
    assert fields
    assert all(hasattr(messages[topic], field) for topic, field in fields)


def test_the_bag_holds_the_inputs_and_outputs(synthetic):
    _, folder, _ = synthetic
    with open_bag(folder / "bag") as bag:
        counts = {name: topic.count for name, topic in bag.topics.items()}
    assert counts["/kinect_left/skeletons"] > 300
    assert counts["/kinect_right/skeletons"] > 300
    assert counts["/imu_torso/data"] > 300
    assert counts["/tf_static"] > 0
    out = [counts[f"/humans/bodies/subject/{x}"] for x in ("joint_states", "skeleton", "estimate")]
    assert min(out) > 50


def test_the_demo_writes_the_reports_page(synthetic):
    _, folder, _ = synthetic
    assert "the simulated truth" in (folder / "report" / "report.html").read_text()


@pytest.mark.data
def test_a_real_recording_is_fused_and_its_views_are_compared(
    start_process, demo, shared_data, tmp_path
):
    recording = shared_data / "kinectmultitrack" / "Study_10_Kinect_1_Time_4_10_14_PM.csv.gz"
    folder = tmp_path / "run"
    # The person stands for 9 s, leaves for 12 and comes back walking.
    process = start_process([demo, recording, "--duration", "45", "-o", folder])
    assert process.wait(2.0 * PATIENCE_S) == 0, process.describe()
    assert "the same joint in two views" in process.output
    path = folder / "report" / "agreement.csv"
    logged = values(path, "distance_as_logged")["left-right", ""]
    calibrated = values(path, "distance_calibrated")["left-right", ""]
    assert calibrated < logged
    variation = values(path, "bone_length_cv")
    assert variation["fused", "left_thigh"] < variation["left", "left_thigh"]


def refused(start_process, demo, words, tmp_path):
    """The one line that a refusal is; nothing may be left."""
    before = sorted(tmp_path.rglob("*"))
    process = start_process([demo, *words], cwd=tmp_path)
    assert process.wait(PATIENCE_S) == 1, process.describe()
    after = [path for path in sorted(tmp_path.rglob("*")) if path.suffix != ".log"]
    assert after == before
    lines = process.output.splitlines()
    assert lines[-1].startswith("error: "), process.output
    return lines[-1]


def test_a_recording_of_one_camera_is_refused(start_process, demo, tmp_path):
    joints = ",".join(f"{joint}_{x}" for joint in JOINTS for x in ("x", "y", "z", "state"))
    rows = [f"left,{0.033 * i:.3f},a{',0,0,2,2' * len(JOINTS)}" for i in range(30)]
    (tmp_path / "one.csv").write_text(
        "\n".join([f"sensor,host_time_s,person,{joints}", *rows]) + "\n"
    )
    line = refused(start_process, demo, ["one.csv"], tmp_path)
    assert "1 camera (left)" in line


def test_a_missing_recording_is_refused(start_process, demo, tmp_path):
    assert "none.csv" in refused(start_process, demo, ["none.csv"], tmp_path)


def test_an_unknown_choreography_is_refused(start_process, demo, tmp_path):
    line = refused(start_process, demo, ["--choreography", "tango"], tmp_path)
    assert "tango" in line


def test_an_interrupt_stops_everything_and_leaves_nothing(start_process, demo, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    process = start_process([demo, "--duration", "8"], cwd=work)
    process.wait_for_output(r"^running", timeout_s=PATIENCE_S)
    assert process.stop() == 130, process.describe()
    assert list(work.iterdir()) == []
    assert start_process.living() == []
