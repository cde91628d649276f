"""The subscribers of docs/subscribing.md."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from sensor_msgs.msg import JointState

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.mark.graph
def test_the_python_subscriber_receives_angles_and_detects_silence(start_process, ros_context):
    topic = "/humans/bodies/subject/joint_states"
    node = ros_context.make_node("publisher")
    publisher = node.create_publisher(JointState, topic, 10)
    process = start_process([sys.executable, EXAMPLES / "follow_joint_states.py"])
    ros_context.spin_until(publisher.get_subscription_count, what="the subscriber")
    publisher.publish(JointState(name=["left_elbow_flexion"], position=[1.25]))
    process.wait_for_output(r"left_elbow_flexion \+1\.250 rad")
    process.wait_for_output("stale: stop")
    assert process.stop() == 0


def test_the_cpp_subscriber_compiles():
    prefixes = [Path(each) for each in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if each]
    folders = [include for prefix in prefixes for include in prefix.glob("include/*")]
    compiler = shutil.which("g++")
    if compiler is None or not any(folder.name == "rclcpp" for folder in folders):
        pytest.skip("needs g++ and the headers of rclcpp")
    includes = [word for folder in folders for word in ("-I", str(folder))]
    words = [compiler, "-std=c++17", "-fsyntax-only", *includes]
    subprocess.run([*words, EXAMPLES / "follow_joint_states.cpp"], check=True, timeout=120)
