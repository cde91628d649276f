"""A graph that goes by a bag's clock: at any pace, looped, sought back, it gives the same poses."""

from contextlib import suppress

import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from patience import skip_if_overloaded
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from skeleton_bag import write_bag
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.stamps import nanoseconds
from pose_io.bags import open_bag

EXECUTABLES = f"{get_package_prefix('pose_fusion')}/lib/pose_fusion"
BODY = "body.yaml"  # measured offline, over the whole bag
STATES = "/humans/bodies/subject/joint_states"
SETTLED_NS = 2_500_000_000  # [ns] after the first state; before, a second round knows the body
FIRST_MEDIAN_DEG = 1.0  # of a first round whose body is measured in its first seconds only
MEDIAN_DEG, MAX_DEG = 0.3, 3.0  # a busy machine may hold up a frame of a sensor here and there

pytestmark = [pytest.mark.graph, pytest.mark.xdist_group("live_graph")]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag")
    _, dof = motion(6.5)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(60), 0.005)
    write_bag(folder / "in", samples, nobody_s=1.0)
    return folder / "in"


@pytest.fixture(scope="module")
def offline(start_module_process, bag):
    """Positions of the joints by stamp [ns]."""
    out, body = bag.parent / "offline", ["--shape-file", bag.parent / BODY]
    fuse = [f"{EXECUTABLES}/fuse", bag, out, "--output-rate", "0", *body]
    assert start_module_process(fuse).wait() == 0
    with open_bag(out) as fused:
        return by_stamp(fused.deserialize(message) for message in fused.messages([STATES]))


def by_stamp(states):
    return {nanoseconds(state.header.stamp): np.array(state.position) for state in states}


def last_of(offline):
    """Only the very last frames are special: offline, nobody waits for what never comes."""
    return sorted(offline)[-4]


def assert_same(live, offline, median_deg=MEDIAN_DEG):
    """The states of a live round are the offline ones, once the filter has settled."""
    begin_ns = min(offline) + SETTLED_NS
    stamps = np.array(sorted(offline))
    angles = np.unwrap([offline[stamp] for stamp in stamps], axis=0)
    errors = [
        np.abs(position - [np.interp(stamp, stamps, column) for column in angles.T]).max()
        for stamp, position in live.items()
        if begin_ns <= stamp <= stamps[-1]
    ]
    assert len(errors) > 0.8 * (stamps > begin_ns).sum()
    assert np.degrees(np.median(errors)) < median_deg
    assert np.degrees(np.quantile(errors, 0.95)) < MAX_DEG


class Graph:
    """A fusion that goes by ``/clock``, and a player."""

    def __init__(self, start_process, ros_context, bag, *words, body=""):
        skip_if_overloaded()
        self._context = ros_context
        self.node = ros_context.make_node("listener")
        self.live = ros_context.collect(JointState, STATES, 5000, self.node)
        parameters = ["-p", "use_sim_time:=true", "-p", "output_rate:=0.0"]
        parameters += ["-p", f"shape_file:={body}"] if body else []
        start_process([f"{EXECUTABLES}/fusion", "--ros-args", *parameters])
        ros_context.spin_until(lambda: self.node.count_publishers(STATES), what="the fusion node")
        play = [f"{EXECUTABLES}/player", bag, "--clock", *words, "--wait-for-subscribers", "60"]
        self.player = start_process(play)

    def round(self, last_ns):
        """Spin until a state of this stamp or later has come; all until then, then begin anew."""
        self._context.spin_until(
            lambda: self.live and nanoseconds(self.live[-1].header.stamp) >= last_ns,
            what="the last state",
        )
        states = by_stamp(self.live)
        self.live.clear()
        return states

    def round_as(self, offline):
        """Expect the offline states in a round; a busy machine may hold up two, not three."""
        for _ in range(2):
            with suppress(AssertionError):
                assert_same(self.round(last_of(offline)), offline)
                return
            self.until_back(min(offline) + SETTLED_NS)
        assert_same(self.round(last_of(offline)), offline)

    def until_back(self, before_ns):
        """Spin until states of before come again."""
        self._context.spin_until(
            lambda: self.live and nanoseconds(self.live[-1].header.stamp) < before_ns,
            what="states of before",
        )

    def set(self, name, value):
        client = self.node.create_client(SetParameters, "/player/set_parameters")
        self._context.spin_until(client.service_is_ready, what="the player's parameters")
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()]
        )
        future = client.call_async(request)
        self._context.spin_until(future.done, what="the answer")
        return future.result().results[0]


@pytest.mark.parametrize(
    ("knows_body", "median_deg"), [(True, MEDIAN_DEG), (False, FIRST_MEDIAN_DEG)]
)
def test_joint_states_at_five_times_real_time_equal_the_offline_ones(
    start_process, ros_context, bag, offline, knows_body, median_deg
):
    body = bag.parent / BODY if knows_body else ""
    graph = Graph(start_process, ros_context, bag, "--rate", "5", body=body)

    live = graph.round(last_of(offline))

    assert_same(live, offline, median_deg)
    assert graph.player.wait() == 0


def test_joint_states_after_a_loop_and_a_seek_equal_the_offline_ones(
    start_process, ros_context, bag, offline
):
    graph = Graph(start_process, ros_context, bag, "--rate", "2", "--loop")
    graph.round(last_of(offline))
    graph.until_back(min(offline) + SETTLED_NS)
    graph.round_as(offline)

    graph.until_back(min(offline) + SETTLED_NS)
    graph.round(min(offline) + SETTLED_NS + 500_000_000)
    assert graph.set("start_offset", 0.5).successful
    graph.until_back(min(offline) + SETTLED_NS)
    graph.round_as(offline)

    refused = graph.set("start_offset", 1e6)
    assert not refused.successful
    assert "after the end" in refused.reason
    assert graph.set("rate", 1).successful
