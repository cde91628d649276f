"""Statistics of a graph, what is wrong with it, and the page of text."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from pose_core.joints import JOINT_INDEX
from pose_fusion.watching.findings import Verdict, graph_findings
from pose_fusion.watching.observation import GraphSnapshot, TopicStatus, TopicWatch, TrackingWatch
from pose_fusion.watching.terminal import page
from pose_node.node_status import Level, NodeStatus

S = 1_000_000_000


def topic(name, rate=30.0, latency_s=0.004, age_s=0.02):
    age_s = None if rate == 0.0 else age_s
    return TopicStatus(name=name, rate=rate, age_s=age_s, latency_s=latency_s)


IMUS = ("pelvis", "torso", "left_thigh", "right_thigh", "left_shank", "right_shank")
NODES = ("/calibration", "/fusion", "/imu_bridge", "/kinect_left", "/kinect_right", "/recorder")
HEALTHY = GraphSnapshot(
    topics=(
        *(topic(f"/imu_{segment}/data", 100.0) for segment in IMUS),
        topic("/kinect_left/skeletons"),
        topic("/kinect_right/skeletons"),
        topic("/humans/bodies/subject/joint_states"),
        topic("/humans/bodies/subject/estimate"),
        topic("/tf"),
    ),
    nodes=NODES,
    statuses=tuple(
        NodeStatus(name=name, level=Level.OK, message="all is well and said at some length")
        for name in NODES
    ),
    tracked={
        "/humans/bodies/subject/skeleton": np.full(15, 1.0),
        "/kinect_left/skeletons": np.full(15, 0.97),
        "/kinect_right/skeletons": np.linspace(0.0, 1.0, 15),
    },
    placed_sensors=("left", "right"),
    fusion_latency_s=(0.012, 0.031),
    hears_itself=True,
)


def changed(snapshot, name, **values):
    """The snapshot with one topic changed."""
    topics = tuple(replace(t, **values) if t.name == name else t for t in snapshot.topics)
    return replace(snapshot, topics=topics)


def verdicts(snapshot):
    return {finding.subject: finding.verdict for finding in graph_findings(snapshot)}


# -- statistics ---------------------------------------------------------------------------------


def test_a_rate_is_in_messages_per_second():
    watch = TopicWatch("/t")
    for index in range(91):
        watch.add(index * S // 30, index * S // 30 - 5_000_000)
    status = watch.status(3 * S)
    assert status.rate == pytest.approx(30.0)
    assert status.latency_s == pytest.approx(0.005)
    assert status.age_s == 0.0


def test_a_silent_topic_has_an_age_and_no_rate():
    watch = TopicWatch("/t")
    for index in range(30):
        watch.add(index * S // 30, None)
    status = watch.status(20 * S)
    assert status.rate == 0.0
    assert status.age_s == pytest.approx(20.0 - 29 / 30)
    assert status.latency_s is None


def test_a_topic_without_messages_has_neither_rate_nor_age():
    status = TopicWatch("/t").status(S)
    assert (status.rate, status.age_s, status.latency_s) == (0.0, None, None)


def test_the_share_of_tracked_frames_is_per_joint_over_a_sliding_window():
    watch = TrackingWatch()
    state = np.full(15, 2, np.uint8)
    watch.add(0, np.zeros(15, np.uint8))
    for index in range(1, 5):
        state[JOINT_INDEX["left_hand"]] = 2 if index % 2 else 1
        watch.add(index * S, state.copy())
    share = watch.share(5 * S)
    assert share[JOINT_INDEX["head"]] == pytest.approx(4 / 5)
    assert share[JOINT_INDEX["left_hand"]] == pytest.approx(2 / 5)
    assert watch.share(6 * S)[JOINT_INDEX["head"]] == 1.0
    assert np.isnan(watch.share(60 * S)).all()


# -- findings -----------------------------------------------------------------------------------


def test_a_healthy_graph_has_no_errors():
    assert set(verdicts(HEALTHY).values()) == {Verdict.OK}


def test_a_graph_that_does_not_run_is_a_note_not_an_error():
    empty = replace(HEALTHY, topics=(), nodes=(), statuses=(), tracked={}, placed_sensors=())
    (messages, nodes) = graph_findings(empty)
    assert messages.verdict is Verdict.OK
    assert nodes.verdict is Verdict.NOTE
    assert "./pose up" in nodes.remedy


def test_middleware_that_receives_nothing_is_the_only_error_reported():
    (finding,) = graph_findings(replace(HEALTHY, hears_itself=False))
    assert finding.verdict is Verdict.WRONG
    assert "firewall" in finding.remedy


@pytest.mark.parametrize(
    ("name", "values", "verdict", "words"),
    [
        ("/kinect_left/skeletons", {"rate": 0.0}, Verdict.WRONG, "is the sensor there"),
        ("/kinect_left/skeletons", {"rate": 4.0}, Verdict.WRONG, "10 Hz or more"),
        ("/kinect_left/skeletons", {"latency_s": -0.2}, Verdict.WRONG, "NTP"),
        ("/kinect_left/skeletons", {"latency_s": 0.3}, Verdict.NOTE, "clocks that differ"),
        ("/humans/bodies/subject/joint_states", {"rate": 0.0}, Verdict.WRONG, "the fusion says"),
    ],
)
def test_a_faulty_stream_is_reported_with_a_remedy(name, values, verdict, words):
    findings = graph_findings(changed(HEALTHY, name, **values))
    found = next(finding for finding in findings if finding.subject == name)
    assert found.verdict is verdict
    assert words in found.remedy


def test_a_silent_imu_is_reported():
    findings = graph_findings(changed(HEALTHY, "/imu_pelvis/data", rate=0.0))
    found = next(finding for finding in findings if finding.subject == "IMUs")
    assert found.verdict is Verdict.WRONG
    assert found.found == "silent: /imu_pelvis/data"


def test_unknown_extrinsics_are_no_error_during_a_calibration():
    unknown = replace(HEALTHY, placed_sensors=("left",))
    assert verdicts(unknown)["extrinsics"] is Verdict.NOTE
    alone = replace(unknown, nodes=("/fusion", "/kinect_left", "/kinect_right"))
    assert verdicts(alone)["extrinsics"] is Verdict.WRONG


def test_a_slow_fusion_is_an_error():
    assert verdicts(replace(HEALTHY, fusion_latency_s=(0.2, 0.4)))["fusion latency"] is (
        Verdict.WRONG
    )


@pytest.mark.parametrize(
    ("level", "verdict"), [(Level.WARN, Verdict.NOTE), (Level.ERROR, Verdict.WRONG)]
)
def test_diagnostics_of_a_node_are_findings(level, verdict):
    status = NodeStatus(name="/imu_bridge", level=level, message="the port was lost")
    findings = graph_findings(replace(HEALTHY, statuses=(status,)))
    found = next(finding for finding in findings if finding.subject == "/imu_bridge")
    assert (found.verdict, found.found) == (verdict, "the port was lost")


def in_namespace(snapshot, namespace):
    """The snapshot of the same graph in a namespace."""
    return replace(
        snapshot,
        topics=tuple(replace(t, name=namespace + t.name) for t in snapshot.topics),
        nodes=tuple(namespace + node for node in snapshot.nodes),
        statuses=tuple(replace(s, name=namespace + s.name) for s in snapshot.statuses),
        tracked={namespace + name: share for name, share in snapshot.tracked.items()},
    )


def test_a_graph_in_a_namespace_has_the_same_findings():
    found = verdicts(in_namespace(HEALTHY, "/operator_1"))
    assert set(found.values()) == {Verdict.OK}
    assert {name.removeprefix("/operator_1") for name in found} == set(verdicts(HEALTHY))


def test_the_reason_of_a_silent_output_is_said_by_the_fusion_of_its_own_namespace():
    graphs = [in_namespace(HEALTHY, namespace) for namespace in ("/a", "/b")]
    statuses = tuple(
        replace(status, message=f"said in {status.name}")
        for graph in graphs
        for status in graph.statuses
    )
    both = replace(HEALTHY, topics=graphs[0].topics + graphs[1].topics, statuses=statuses)
    silent = changed(both, "/b/humans/bodies/subject/joint_states", rate=0.0)

    (found,) = [each for each in graph_findings(silent) if each.verdict is Verdict.WRONG]
    assert found.remedy == "the fusion says: said in /b/fusion"


def test_a_body_that_rests_on_imus_is_not_wrong_without_any():
    (fusion,) = [status for status in HEALTHY.statuses if status.name == "/fusion"]
    alone = replace(
        fusion,
        name="/fusion_imu",
        message="no IMUs: the estimator imu needs them",
        values={"subject": "subject_imu"},
    )
    output = next(each for each in HEALTHY.topics if each.name.endswith("/joint_states"))
    name = "/humans/bodies/subject_imu/joint_states"
    graph = replace(
        HEALTHY,
        topics=(*HEALTHY.topics, replace(output, name=name, rate=0.0)),
        statuses=(replace(fusion, values={"subject": "subject"}), alone),
    )
    (found,) = [each for each in graph_findings(graph) if each.subject == name]
    assert found.verdict is Verdict.NOTE


# -- the page -----------------------------------------------------------------------------------


def shown(snapshot, height=24):
    console = Console(file=io.StringIO(), width=80, height=height)
    console.print(page(snapshot, "12:00:00", height))
    return console.file.getvalue().splitlines()


def test_the_page_of_a_full_graph_fits_into_80_columns_and_24_lines():
    lines = shown(HEALTHY)
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    assert not any("…" in line for line in lines)


def test_the_page_shows_rates_latencies_shares_and_diagnostics():
    text = "\n".join(shown(HEALTHY))
    assert "rate [Hz]" in text
    assert "latency [ms]" in text
    assert "imu_*/data (6 IMUs)" in text
    assert "12, p99 31" in text
    assert "97" in text
    assert "all is well" in text
    assert "extrinsics: left, right" in text


def test_the_page_of_a_graph_in_a_namespace_shows_its_body_and_the_ends_of_its_nodes_names():
    lines = shown(in_namespace(HEALTHY, "/operator_1"))
    assert any(line.startswith("operator_1/subject/joint_states ") for line in lines)
    assert any(line.split() == ["tracked", "[%]", "kinect", "kinect", "subject"] for line in lines)
    assert any(line.startswith("…ator_1/fusion all is well") for line in lines)


def test_errors_are_shown_first_on_a_small_page():
    status = NodeStatus(name="/zzz", level=Level.ERROR, message="the port was lost")
    lines = shown(replace(HEALTHY, statuses=(*HEALTHY.statuses, status)), height=20)
    assert len(lines) <= 20
    assert any("zzz" in line and "the port was lost" in line for line in lines)
    assert "more nodes" in lines[-1]


def test_a_node_with_a_long_message_is_still_named():
    status = NodeStatus(name="/calibration", level=Level.OK, message="calibrated " * 20)

    line = shown(replace(HEALTHY, statuses=(status,)))[-1]

    assert line.startswith("calibration    calibrated calibrated")
    assert line.endswith("…")


def test_the_page_of_an_empty_graph_says_how_to_start_one():
    empty = replace(HEALTHY, topics=(), statuses=(), tracked={}, placed_sensors=())
    text = "\n".join(shown(replace(empty, fusion_latency_s=None)))
    assert "no messages yet: try ./pose doctor" in text
    assert "not known yet" in text


def test_a_replayed_recording_has_no_latency():
    text = "\n".join(shown(changed(HEALTHY, "/kinect_left/skeletons", latency_s=1e6)))
    assert "replayed" in text


@pytest.mark.parametrize(
    "name",
    ["/kinect_left/skeletons", "/imu_torso/data", "/humans/bodies/subject/joint_states"],
)
def test_a_topic_with_several_publishers_is_a_fault(name):
    findings = graph_findings(changed(HEALTHY, name, publishers=2))
    (wrong,) = [finding for finding in findings if finding.verdict is Verdict.WRONG]
    assert (wrong.subject, wrong.found[:12]) == (name, "2 publishers")
    assert not [f for f in graph_findings(changed(HEALTHY, "/tf", publishers=2)) if f.remedy]
