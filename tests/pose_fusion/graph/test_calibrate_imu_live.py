"""``./pose calibrate imu`` beside a live graph: it ends by itself (a synthetic person)."""

import re
import time

import pytest
from patience import PATIENCE_S

from pose_calibration.imus.section import load_alignments
from pose_fusion.tools.demo_run import first_lead_s
from pose_node.child_process import executable

pytestmark = pytest.mark.graph

GENERATING_S = 6.0  # the session is made, and all processes are up, in the time until its start


def test_n_pose_and_motion_give_an_alignment_file_and_the_tool_ends(start_process, tmp_path):
    """The Kinects' places are found meanwhile, by a calibration node that is told nothing."""
    session, output = tmp_path / "session", tmp_path / "session.yaml"
    start_at = str(time.time_ns() + round((first_lead_s() + GENERATING_S) * 1e9))
    generate = start_process(
        [
            executable("pose_sim", "generate"),
            *("--choreography", "leg_lift_march", "--duration", "45", "--seed", "6"),
            *("--start-at", start_at, "-o", session),
        ]
    )
    assert generate.wait(PATIENCE_S) == 0
    link = session / "imu_device"
    start_process(
        [executable("pose_sim", "imu_device"), session, "--link", link, "--start-at", start_at]
    )
    start_process(
        [
            *(executable("pose_launch", "up"), "sensors.launch.yaml"),
            *(f"recording:={session}/kinects.csv", "format:=csv", f"start_at:={start_at}"),
            *("sensor_left:=left", "sensor_right:=right", "imus:=true", f"imu_port:={link}"),
            *("imu_wait_for_port:=240.0", f"imu_nodes_file:={session}/imu_nodes.yaml"),
        ]
    )
    start_process([executable("pose_fusion", "calibration")])
    tool = start_process(
        [executable("pose_fusion", "calibrate"), "imu", "-o", output, "--timeout", "90"]
    )
    assert tool.wait(PATIENCE_S) == 0, tool.output
    assert "not calibrated" not in tool.output
    assert re.search(r"[1-9]\d*%  (move|bend|lift|turn|swing)", tool.output)
    assert len(load_alignments(output)) == 9
