"""What is kept of a live graph's messages."""

import pytest
from viewed_bag import FRAME_NS, START_NS, moving_joints, skeleton_message

from pose_fusion.conversions import to_header
from pose_view.live import LiveGraph

JOINTS = moving_joints(1.0)
S = 1_000_000_000


@pytest.fixture
def graph():
    return LiveGraph({"subject": "Fused"}, ["left"], span_s=10.0)


def feed(graph, stamps_ns):
    for stamp_ns in stamps_ns:
        message = skeleton_message(JOINTS[0], to_header(stamp_ns), "subject")
        graph.add_skeleton("subject", message)


def stamps(graph):
    return graph.track("subject", 0.0, 1e12).stamps_ns.tolist()


def test_a_late_skeleton_is_left_out_and_counted(graph):
    times = [START_NS + k * FRAME_NS for k in range(20)]
    feed(graph, [*times[:10], times[4], *times[10:]])

    assert stamps(graph) == times
    assert graph.counters["late_skeletons"] == 1


def test_a_recording_that_begins_anew_begins_new_curves(graph):
    first = [START_NS + 60 * S + k * FRAME_NS for k in range(5)]
    again = [START_NS + k * FRAME_NS for k in range(5)]
    feed(graph, [*first, *again])

    assert stamps(graph) == again


def test_no_more_is_kept_than_the_plots_show(graph):
    feed(graph, [START_NS + k * S // 10 for k in range(600)])

    assert len(stamps(graph)) == pytest.approx(111, abs=2)


def test_a_malformed_skeleton_is_counted(graph):
    message = skeleton_message(JOINTS[0], to_header(START_NS), "subject")
    message.name = ["head"]
    graph.add_skeleton("subject", message)

    assert stamps(graph) == []
    assert graph.counters["malformed_skeletons"] == 1


def test_the_recorders_bag_is_known_from_what_it_reports(graph):
    assert graph.bag() is None
    graph.add_report("/recorder", 0, "not recording", {"bag": ""}, 0)
    assert graph.bag() == ""
    graph.add_report("/recorder", 0, "recording", {"bag": "out/b"}, 0)
    assert graph.bag() == "out/b"
    assert any("recording" in line.text for line in graph.lines(S))


def test_a_body_that_nothing_has_come_of_for_a_second_is_not_shown(graph):
    feed(graph, [START_NS])
    graph.note_skeleton("subject", START_NS, START_NS)

    assert list(graph.snapshot(START_NS + S // 2).bodies) == ["subject"]
    assert not graph.snapshot(START_NS + 2 * S).bodies
