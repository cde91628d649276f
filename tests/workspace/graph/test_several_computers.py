"""Two sensor hosts and a fusion host, with a network between them that delays and loses.

The hosts are network namespaces that the test makes. They share the machine's clock: a clock that
is ahead and drifts is in the right sensor's recording, and in the calibration that knows of it.
"""

import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hosts import make_hosts
from patience import skip_if_overloaded
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_calibration.files.extrinsics_file import save_extrinsics
from pose_core.joints import JOINTS
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_core.streams.clocks import Clock
from pose_io.bags import open_bag
from pose_node.child_process import executable

ROOT = Path(__file__).parents[3]
HOSTS = ("left", "right", "fusion")
BODY = "/humans/bodies/subject"
AHEAD_S, DRIFT = 0.040, 50e-6  # of the right sensor's clock
DURATION_S = 120.0
DELAY_MS = 20

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]

TALK = """
import time, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(String, "words", 10)
print("talking", flush=True)
while True:
    publisher.publish(String(data="private"))
    time.sleep(0.05)
"""
COUNT = """
import rclpy
from pose_msgs.msg import PoseEstimate
rclpy.init()
node = rclpy.create_node("counter")
poses = []
node.create_subscription(PoseEstimate, "/humans/bodies/subject/estimate", poses.append, 10)
while len(poses) < 90:
    rclpy.spin_once(node, timeout_sec=0.1)
"""
LISTEN = """
import sys, time, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("listener")
heard = []
node.create_subscription(String, "words", heard.append, 10)
end = time.monotonic() + float(sys.argv[1])
while not heard and time.monotonic() < end:
    rclpy.spin_once(node, timeout_sec=0.1)
print("heard" if heard else "silent", flush=True)
"""


@pytest.fixture
def hosts():
    with make_hosts(HOSTS) as made:
        yield made


@pytest.fixture
def start_on(hosts, start_process):
    """Start a process on a host, whose nodes look for the fusion host, or for nobody else."""

    def start(host, command, *, peers=(), private=False, **options):
        profile = "fastdds_loopback.xml" if private else "fastdds.xml"
        environment = {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "scripts" / profile),
            "ROS_STATIC_PEERS": ";".join(hosts.addresses[peer] for peer in peers),
        }
        return start_process(hosts.command(host, command), env=environment, **options)

    return start


def write_recording(path):
    """Both sensors' view of a moving body; the right one's clock is ahead, and drifts.

    Returns:
        The true course of each joint angle [rad], at 30 Hz.
    """
    _, dof = motion(DURATION_S, still_s=1.0)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(
        positions, extrinsics(), np.random.default_rng(70), 0.005, start_ns=100 * NS_PER_S
    )
    columns = [f"{joint}_{part}" for joint in JOINTS for part in ("x", "y", "z", "state")]
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["sensor", "host_time_s", "sensor_time_s", "person", *columns])
        for sample in samples:
            at_s = (sample.stamp_ns - 100 * NS_PER_S) / NS_PER_S
            stamp_s = 100.0 + at_s
            if sample.sensor == "right":
                stamp_s += AHEAD_S + DRIFT * at_s
            numbers = [v for point in sample.positions for v in (*(f"{x:.4f}" for x in point), 2)]
            table.writerow([sample.sensor, f"{stamp_s:.6f}", f"{stamp_s:.6f}", "1", *numbers])
    return {
        name: dof[:, kinematics().model.dof_index[name]] for name in kinematics().model.angle_names
    }


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """The file, and the true angles."""
    path = tmp_path_factory.mktemp("recording") / "walk.csv"
    return path, write_recording(path)


@pytest.fixture
def graph(start_on, hosts, recording, tmp_path):
    """Start all; where the bag is, and when the recording began."""
    skip_if_overloaded()
    path, truth = recording
    start_ns = time.time_ns() + 2 * NS_PER_S
    clock = Clock(offset_ns=round(AHEAD_S * NS_PER_S), drift=DRIFT, at_ns=start_ns)
    known = replace(extrinsics(), clocks={"right": clock})
    save_extrinsics(tmp_path / "extrinsics.yaml", known)
    sensor_hosts = ("left", "right")
    fusion = (*("--ros-args", "-p"), f"extrinsics_file:={tmp_path / 'extrinsics.yaml'}")
    start_on("fusion", [executable("pose_fusion", "fusion"), *fusion], peers=sensor_hosts)
    topics = [f"{BODY}/joint_states", f"{BODY}/estimate", "/diagnostics"]
    topics += [f"/kinect_{sensor}/skeletons" for sensor in sensor_hosts]
    recorder = start_on(
        "fusion",
        [executable("pose_fusion", "recorder"), "-o", str(tmp_path / "bag"), *topics],
        peers=sensor_hosts,
    )
    for sensor in sensor_hosts:
        values = {
            "name": sensor,
            "sensor": sensor,
            "file": path,
            "clock": "host",
            "start_at": f"'{start_ns}'",
        }
        words = [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]
        program = [executable("kinect_bridge", "kinect_bridge"), "--ros-args", *words]
        start_on(sensor, program, peers=("fusion",))
    return Graph(recorder, tmp_path / "bag", start_ns, truth, start_on)


class Graph:
    """A run, and what the recorder on the fusion host has heard of it."""

    def __init__(self, recorder, bag, start_ns, truth, start_on):
        self._recorder, self._bag, self._start_on = recorder, bag, start_on
        self.start_ns, self.truth = start_ns, truth

    @property
    def now_s(self):
        """How far the recording is."""
        return (time.time_ns() - self.start_ns) / NS_PER_S

    def wait_until(self, at_s):
        """Until the recording is so far."""
        while self.now_s < at_s:
            time.sleep(0.1)

    def wait_for_poses(self):
        """Until poses come; how far the recording then is."""
        poses = self._start_on("fusion", [sys.executable, "-c", COUNT], peers=("left", "right"))
        assert poses.wait() == 0, poses.describe()
        return self.now_s

    def end(self):
        assert self._recorder.stop() == 0
        with open_bag(self._bag) as bag:
            topics = [topic for topic in bag.topics if topic != "/diagnostics"]
            self.messages = {topic: [] for topic in bag.topics}
            for message in bag.messages(topics):
                self.messages[message.topic].append(bag.deserialize(message))

    def times(self, topic, *, since_s=0.0, until_s=DURATION_S):
        """Stamps of its messages [s] after the recording's begin."""
        stamps = [nanoseconds(m.header.stamp) for m in self.messages.get(topic, [])]
        times = (np.array(stamps) - self.start_ns) / NS_PER_S
        return times[(times >= since_s) & (times < until_s)]

    def errors_deg(self, *, since_s, until_s):
        """RMS error of the angles in a stretch."""
        errors = []
        for state in self.messages[f"{BODY}/joint_states"]:
            at_s = (nanoseconds(state.header.stamp) - self.start_ns) / NS_PER_S
            if since_s <= at_s < until_s:
                errors += [
                    angle
                    - np.interp(at_s * 30.0, np.arange(len(self.truth[name])), self.truth[name])
                    for name, angle in zip(state.name, state.position, strict=True)
                    if name in self.truth and name.endswith("flexion")
                ]
        return float(np.degrees(np.sqrt(np.mean(np.square(errors)))))

    def latency_ms(self):
        """Median and 99th percentile, of the newest sample's stamp to the publication."""
        values = [1e3 * m.latency for m in self.messages[f"{BODY}/estimate"]]
        return np.percentile(values, [50, 99])


def test_cameras_on_two_hosts_are_fused_on_a_third(graph, hosts):
    hosts.network(f"delay {DELAY_MS} {DELAY_MS / 4}")
    hosts.network("loss 1")
    begin_s = graph.wait_for_poses()
    before = hosts.sent_bytes()
    graph.wait_until(begin_s + 6.0)
    sent, end_s = hosts.sent_bytes(), graph.now_s
    graph.wait_until(end_s + 0.5)
    graph.end()

    elapsed_s, span = end_s - begin_s, {"since_s": begin_s, "until_s": end_s}
    median, high = graph.latency_ms()
    rates = {host: (sent[host] - before[host]) / elapsed_s / 1e3 for host in ("left", "right")}
    error = graph.errors_deg(**span)
    print(f"{DELAY_MS} ms: latency {median:.1f}, p99 {high:.1f} ms; {rates} kB/s; {error:.2f} deg")
    for sensor in ("left", "right"):
        assert len(graph.times(f"/kinect_{sensor}/skeletons", **span)) > 0.9 * 30 * elapsed_s
        assert rates[sensor] < 200.0
    assert np.diff(graph.times(f"{BODY}/joint_states", **span)).max() < 0.5
    assert error < 5.0
    assert median > DELAY_MS


def test_a_host_returns_after_ten_seconds_without_network(graph, hosts):
    hosts.network("delay 5 1")
    begin_s = graph.wait_for_poses()
    hosts.network("cut left")
    graph.wait_until(begin_s + 10.0)
    hosts.network("mend left")
    graph.wait_until(begin_s + 15.0)
    graph.end()

    # Some frames of the last seconds wait in queues on the way, and arrive when the host is back.
    gone = {"since_s": begin_s + 0.5, "until_s": begin_s + 5.0}
    back = {"since_s": begin_s + 11.0, "until_s": begin_s + 14.5}
    assert len(graph.times("/kinect_left/skeletons", **gone)) == 0
    assert np.diff(graph.times(f"{BODY}/joint_states", **gone)).max() < 0.5
    assert len(graph.times("/kinect_left/skeletons", **back)) > 0.9 * 30 * 3.5
    assert graph.errors_deg(**back) < 5.0


def test_a_graph_on_localhost_is_not_received_by_another_host(hosts, start_on):
    talker = start_on("left", [sys.executable, "-c", TALK], private=True)
    talker.wait_for_output("talking")

    beside = start_on("left", [sys.executable, "-c", LISTEN, "60"], private=True)
    assert beside.wait() == 0
    assert "heard" in beside.output

    outside = start_on("right", [sys.executable, "-c", LISTEN, "4"], peers=("left",))
    assert outside.wait() == 0
    assert "silent" in outside.output
