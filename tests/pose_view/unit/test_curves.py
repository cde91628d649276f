"""Content of the panels: curves, plots, streams and status lines."""

import re
from dataclasses import replace

import numpy as np
import pytest
from viewed_bag import FRAME_NS, START_NS, moving_joints

from pose_core.body.joint_angles import joint_angles
from pose_core.joints import JOINT_INDEX
from pose_fusion.watching.observation import TopicWatch
from pose_node.node_status import Level, NodeStatus
from pose_view.curves import BodyTrack, curve, occlusion, on_grid, titles
from pose_view.plain_words import StatusLine, as_html, imu_line, node_line, stream_line
from pose_view.web.plots import svg_plot, ticks

JOINTS = moving_joints(4.0)
TRACK = BodyTrack(times_s=(START_NS + FRAME_NS * np.arange(len(JOINTS))) * 1e-9, joints=JOINTS)
S = 1_000_000_000


def arm(direction):
    """Skeletons whose right forearm points there."""
    joints = np.repeat(JOINTS[:1], len(direction), axis=0)
    elbow = joints[:, JOINT_INDEX["right_elbow"]]
    joints[:, JOINT_INDEX["right_hand"]] = elbow + 0.3 * np.asarray(direction, float)
    return BodyTrack(times_s=np.arange(len(direction)) * 1e-9, joints=joints)


def test_pitch_is_the_elevation_of_a_segment_and_yaw_its_heading():
    track = arm([[-1, 0, 0], [0, -1, 0], [0, 0, -1], [0.0, 0.7, 0.7]])

    assert curve("Pitch: right forearm", track) == pytest.approx([0, 0, -90, 45])
    assert curve("Yaw: right forearm", track) == pytest.approx([180, 270, np.nan, 90], nan_ok=True)


def test_yaw_breaks_where_it_passes_a_whole_turn():
    values = np.array([350.0, 358.0, 6.0, 14.0])
    found = on_grid(np.arange(4.0), values, np.array([0.5, 1.5, 2.5]), 2.0)

    assert found == pytest.approx([354.0, np.nan, 10.0], nan_ok=True)


def test_measured_angles_are_those_of_every_table():
    expected = np.degrees(joint_angles(JOINTS)["right_knee_flexion"])
    assert curve("Right knee flexion", TRACK) == pytest.approx(expected)


def test_the_flexion_of_a_limb_that_points_sideways_is_left_out():
    joints = JOINTS[:1].copy()
    shoulder = joints[0, JOINT_INDEX["right_shoulder"]]
    sideways = shoulder - joints[0, JOINT_INDEX["left_shoulder"]]
    joints[0, JOINT_INDEX["right_elbow"]] = shoulder + sideways
    track = BodyTrack(times_s=np.zeros(1), joints=joints)

    assert np.isnan(curve("Right shoulder flexion", track)).all()
    assert np.isfinite(curve("Right shoulder abduction", track)).all()


def test_every_offered_curve_can_be_drawn():
    names = ("pelvis_x",) * 6 + ("waist_flexion",)
    track = BodyTrack(
        times_s=TRACK.times_s,
        joints=JOINTS,
        dof_names=names,
        dof=np.full((len(JOINTS), 7), 0.5),
    )
    offered = titles(names)

    assert offered[-1] == "Model: waist flexion"
    assert curve(offered[-1], track) == pytest.approx(np.degrees(np.full(len(JOINTS), 0.5)))
    assert all(len(curve(title, track)) == len(JOINTS) for title in offered)


def test_a_model_angle_that_a_body_lacks_is_left_blank():
    assert np.isnan(curve("Model: waist flexion", TRACK)).all()


def test_curves_are_blank_in_gaps_and_beyond_their_ends():
    times, values = np.array([0.0, 0.1, 0.2, 0.9, 1.0]), np.arange(5.0)
    found = on_grid(times, values, np.array([-0.1, 0.05, 0.5, 0.95, 1.1]), 0.25)

    assert found == pytest.approx([np.nan, 0.5, np.nan, 3.5, np.nan], nan_ok=True)


def test_a_limb_is_occluded_while_the_first_camera_does_not_track_an_end_of_it():
    is_occluded = np.zeros((len(JOINTS), len(JOINT_INDEX)), bool)
    is_occluded[30:60, JOINT_INDEX["right_hand"]] = True
    track = replace(TRACK, is_occluded=is_occluded)

    for kind in ("Pitch", "Yaw", "Roll"):
        found = occlusion(f"{kind}: right forearm", track, TRACK.times_s)
        assert found.tolist() == is_occluded.any(axis=1).tolist()
    for title in ("Pitch: right upper arm", "Right elbow flexion"):
        assert not occlusion(title, track, TRACK.times_s).any()


def test_a_plot_is_grey_from_the_first_to_the_last_marked_value():
    x, grey = np.linspace(0.0, 4.0, 5), np.array([False, True, True, False, True])
    labels = {"x_label": "", "y_label": "", "y_range": (0.0, 1.0)}
    picture = svg_plot(x, [], [], is_grey=grey, **labels)
    boxes = re.findall(r'<rect x="([0-9.]+)" y="[0-9]+" width="([0-9.]+)"', picture)

    left, right = 40.0, 332.0  # [px] of 0 and 4
    step = (right - left) / 4.0
    assert np.array(boxes, float).ravel() == pytest.approx([left + step, 2 * step, right, 0.0])


def test_a_plot_interrupts_its_curve_at_unknown_values():
    x = np.linspace(0.0, 4.0, 5)
    picture = svg_plot(
        x,
        [np.array([0.0, 1.0, np.nan, 3.0, 4.0])],
        ["#123456"],
        x_label="time [s]",
        y_label="angle [°]",
        y_range=(0.0, 10.0),
    )
    path = re.search(r'<path d="([^"]*)" fill="none" stroke="#123456"', picture)[1]

    assert path.count("M") == 2
    assert path.count("L") == 2
    assert "time [s]" in picture
    assert "angle [°]" in picture


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0, 10, [0, 2, 4, 6, 8, 10]), (-95, 95, [-90, -45, 0, 45, 90]), (-10.0, 0.0, None)],
)
def test_ticks_are_round_and_few(low, high, expected):
    found = ticks(low, high)

    assert found == (expected or [-10, -8, -6, -4, -2, 0])


def test_a_stream_has_rate_delay_dropouts_and_silence():
    watch = TopicWatch("", 2.0)
    assert stream_line("", watch.status(0)).text == "nothing yet"
    stamps = [k * FRAME_NS for k in range(60) if not 30 <= k < 42]
    for stamp in stamps:
        watch.add(stamp + 20_000_000, stamp)
    status = watch.status(stamps[-1] + 20_000_000)

    assert status.latency_s == pytest.approx(0.02)
    assert status.gaps == 1
    assert status.longest_gap_s == pytest.approx(13 / 30, abs=0.01)
    line = stream_line("Kinect left", status)
    assert line.level is Level.WARN
    assert "20 ms after capture, 1 dropout in a minute (longest 0.4 s)" in line.text
    assert "silent for 3 s" in stream_line("", watch.status(stamps[-1] + 3 * S)).text


def test_a_steady_stream_is_good_news():
    watch = TopicWatch("", 2.0)
    for k in range(90):
        watch.add(k * FRAME_NS + 5_000_000, k * FRAME_NS)

    line = stream_line("Fused", watch.status(89 * FRAME_NS + 5_000_000), 0.013)
    assert line == StatusLine(level=Level.OK, title="Fused", text="30 Hz, 13 ms after capture")


def test_imus_are_summed_up():
    values = {"pelvis.rate_hz": "99.0", "pelvis.lost": "4", "head.rate_hz": "0.0", "head.lost": "1"}
    report = NodeStatus(
        name="/imu_bridge", level=Level.WARN, message="silent nodes: head", values=values
    )
    line = imu_line(report, S // 3)

    assert line.text == "1 of 2 send, 99 Hz each, 5 frames lost on the air; silent nodes: head"
    assert line.level is Level.WARN


def test_a_silent_node_is_an_error():
    report = NodeStatus(name="/fusion", message="tracking")

    assert node_line("Fusion", report, 8 * S).level is Level.ERROR
    assert node_line("Fusion", None, 8 * S).text == "not running"


def test_lines_cannot_smuggle_html_into_the_page():
    html = as_html([StatusLine(level=Level.OK, title="<b>", text="<script>")])

    assert "<script>" not in html
    assert "&lt;script&gt;" in html
