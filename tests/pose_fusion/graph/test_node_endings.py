"""Every node tells its parameters, and ends well on whatever signal, whenever it comes."""

import signal

import pytest
from ament_index_python.packages import get_package_prefix

NODES = {
    "calibration": "pose_fusion",
    "fusion": "pose_fusion",
    "player": "pose_fusion",
    "recorder": "pose_fusion",
    "imu_bridge": "imu_bridge",
    "kinect_bridge": "kinect_bridge",
    "viewer": "pose_view",
}
THAT_RUN = {  # without a device or a recording
    "fusion": (),
    "recorder": ("-p", "all:=true", "-p", "output:=bag"),
    "viewer": ("-p", "port:=0"),
}
LINES = 45  # half a page

pytestmark = pytest.mark.graph


def path_of(node):
    return f"{get_package_prefix(NODES[node])}/lib/{NODES[node]}/{node}"


@pytest.mark.parametrize("node", NODES)
def test_help_is_half_a_page_and_starts_no_ros(start_process, node):
    # With a file of profiles that is none, ROS would complain.
    process = start_process([path_of(node), "--help"], env={"ROS_DOMAIN_ID": "no number"})

    assert process.wait() == 0
    assert process.output.startswith("usage: ")
    assert len(process.output.splitlines()) <= LINES


@pytest.mark.parametrize("node", ["fusion", "viewer"])
def test_an_unknown_argument_is_refused(start_process, node):
    process = start_process([path_of(node), "rate:=10"])

    assert process.wait() == 2
    assert "does not know 'rate:=10': parameters go as '--ros-args -p" in process.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda one: one.name)
@pytest.mark.parametrize("node", THAT_RUN)
def test_repeated_signals_end_a_running_node_cleanly(
    ros_context, start_process, tmp_path, node, number
):
    watcher = ros_context.make_node("watcher")
    process = start_process([path_of(node), "--ros-args", *THAT_RUN[node]], cwd=tmp_path)
    ros_context.spin_until(lambda: node in watcher.get_node_names(), what=node)

    for _ in range(3):
        process.signal(number)

    assert process.wait() == 0, process.describe()
    assert "Traceback" not in process.output
    assert start_process.living() == []


IMPORTS = "import time\nprint('importing', flush=True)\ntime.sleep(600)\n"
# Python drops what a destructor raises, as it does with what importing calls behind the scenes.
DESTROYS = """
import time
class Slow:
    def __del__(self):
        print('importing', flush=True)
        time.sleep(600)
Slow()
time.sleep(600)
"""


@pytest.mark.parametrize("text", [IMPORTS, DESTROYS], ids=["imports", "destroys"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda one: one.name)
def test_signals_during_imports_end_a_node_cleanly(start_process, tmp_path, number, text):
    (tmp_path / "slow_package").mkdir()
    (tmp_path / "slow_package" / "nodes").mkdir()
    (tmp_path / "slow_package" / "nodes" / "slow.py").write_text(text)
    program = "from pose_node.entry import start; start.slow_package.nodes.slow()"
    process = start_process(["python", "-c", program], cwd=tmp_path)
    process.wait_for_output("importing")

    for _ in range(3):
        process.signal(number)

    assert process.wait() == 0
    assert "Traceback" not in process.output
