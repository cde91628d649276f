"""The fusion's report in ``/diagnostics`` (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_core.api import PeoplePipeline, PipelineParameters
from pose_core.counters import Counters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import Clock
from pose_core.streams.samples import ImuSample, block_of
from pose_core.streams.stamp_check import StampCheck
from pose_fusion.nodes.fusion_report import FusionReporter
from pose_fusion.sample_reader import COUNTS, SampleReader
from pose_fusion.watching.cameras import IMPLAUSIBLE, UNDECIDED
from pose_node.node_status import Level

NOW_NS = 1_764_000_000 * NS_PER_S
DURATION_S = 12.0
ANGULAR_VELOCITY = "the angular velocity of the IMU on left_thigh"


def report_of(change_rate):
    """The report after some seconds in which the left thigh's angular velocity is changed."""
    _, _, skeletons, imus = moving_wearer(DURATION_S)
    imus = [
        replace(s, angular_velocity=change_rate(s.angular_velocity))
        if s.segment == "left_thigh"
        else s
        for s in imus
    ]
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    for sample in merged(skeletons, imus):
        pipeline.add(sample if isinstance(sample, ImuSample) else [sample])
    reader = SampleReader(parameters.sensors, check=None, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    reporter.check()
    return reporter.report((), {}, {})


@pytest.mark.parametrize(
    ("change_rate", "what"),
    [
        (np.degrees, "does not match the orientation's change: degrees per second?"),
        (np.zeros_like, "stays zero while the orientation turns"),
        (lambda rate: -rate, "flipped axis, or another frame"),
    ],
)
def test_an_imu_with_a_wrong_angular_velocity_is_reported(change_rate, what):
    report = report_of(change_rate)
    assert report.level == Level.WARN
    assert ANGULAR_VELOCITY in report.message
    assert what in report.message
    assert what in report.values["imu/left_thigh"]


def test_an_imu_without_a_gyroscope_causes_no_warning():
    report = report_of(lambda rate: np.full_like(rate, np.nan))
    assert ANGULAR_VELOCITY not in report.message
    assert "is not measured; the orientation's change is used" in report.values["imu/left_thigh"]


def test_every_unused_imu_is_named_with_its_reason():
    _, _, skeletons, imus = moving_wearer(DURATION_S)
    still = {sample.segment: sample for sample in reversed(imus)}
    names = {"torso": "left_hand"}  # the body has no link for it
    imus = [
        replace(still[s.segment], stamp_ns=s.stamp_ns, angular_velocity=np.zeros(3))
        if s.segment in ("left_thigh", "left_shank")
        else replace(s, segment=names.get(s.segment, s.segment))
        for s in imus
    ]
    reporter, reader = reporter_of(merged(skeletons, imus))
    reporter.check()
    message = reporter.report((), {}, {}).message
    assert "the IMUs on left_shank, left_thigh are not used: it has not turned by 8°" in message
    assert "the IMU on left_hand is not used: the body model has no link" in message
    assert "left_forearm" not in message
    reader.oriented = {"left_hand": False}
    reporter.check()
    message = reporter.report((), {}, {}).message
    assert "the IMU on left_hand is not used" not in message
    assert "the messages of the IMU on left_hand have no orientation" in message


def test_sources_excluded_for_one_reason_share_a_remark():
    _, _, skeletons, _ = moving_wearer(1.0)
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    check = StampCheck()
    for sample in skeletons:
        check.skeleton(sample, sample.stamp_ns + 60 * NS_PER_S, {})
    reader = SampleReader(parameters.sensors, check=check, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    message = reporter.report((), {}, {}).message
    assert "left, right are not used: their stamps are 60.0 s behind their arrival" in message


def test_topics_with_as_many_publishers_share_a_remark():
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    reader = SampleReader(parameters.sensors, check=None, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    message = reporter.report((), {}, {}, {"a": 2, "b": 3, "c": 2}).message
    assert "2 publishers of a, c: started twice? Stop all but one; 3 publishers of b: " in message


def test_imus_that_are_published_and_have_sent_nothing_are_named():
    reporter, _ = reporter_of(moving_wearer(1.0)[2])
    report = reporter.report((), {}, {}, unheard_imus=["head", "torso"])
    assert "the IMU on head, torso is published, but has sent nothing yet" in report.message
    assert report.level == Level.WARN


def test_imus_that_are_published_and_not_read_are_named_and_no_fault():
    reporter, _ = reporter_of(moving_wearer(3.0)[2])
    reporter.check()
    unread = dict.fromkeys(("head", "torso"), "use_imus is false")
    report = reporter.report((), {}, {}, unread_imus=unread)
    assert report.message == "tracking; IMUs not used: head, torso: use_imus is false"
    assert report.level == Level.OK


def test_nobody_being_chosen_is_a_warning():
    _, _, skeletons, _ = moving_wearer(3.0)
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    for sample in skeletons:
        pipeline.add([sample])
    reader = SampleReader(parameters.sensors, check=None, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    reporter.check()
    assert reporter.report((), {}, {}).level == Level.OK
    pipeline.choice.choose_by("anna")
    for sample in moving_wearer(4.0)[2][len(skeletons) :]:
        pipeline.add([sample])
    reporter.check()
    report = reporter.report((), {}, {})
    assert report.message.startswith("nobody is chosen yet by person = anna")
    assert report.level == Level.WARN


def reporter_of(samples):
    """A reporter after these skeletons, and its reader."""
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    for sample in samples:
        pipeline.add(sample if isinstance(sample, ImuSample) else [sample])
    reader = SampleReader(parameters.sensors, check=StampCheck(), counters=Counters(*COUNTS))
    return FusionReporter(pipeline, reader), reader


def test_cameras_that_show_the_subject_before_the_first_pose_are_not_called_silent():
    reporter, _ = reporter_of(moving_wearer(3.0)[2])
    assert reporter.report((), {}, {}).message.startswith("starting: the cameras show the subject")
    for _ in range(10):
        reporter.check()
    assert reporter.report((), {}, {}).message.startswith("no skeletons: the sensors see nobody")


def test_an_imu_without_orientation_or_plausible_stamps_is_not_called_silent():
    _, _, skeletons, imus = moving_wearer(4.0)
    until_ns = imus[0].stamp_ns + 2 * NS_PER_S
    reporter, reader = reporter_of(merged(skeletons, [s for s in imus if s.stamp_ns < until_ns]))
    reporter.check()
    assert "has sent nothing for 0.2 s or more" in reporter.report((), {}, {}).message
    reader.oriented = {sample.segment: False for sample in imus}
    reporter.check()
    message = reporter.report((), {}, {}).message
    assert "has sent nothing" not in message
    assert "have no orientation" in message
    for sample in 10 * list({sample.segment: sample for sample in imus}.values()):
        arrivals_ns = np.array([sample.stamp_ns])
        reader.check.imus(block_of(replace(sample, stamp_ns=0)), arrivals_ns, {})
    reporter.check()
    message = reporter.report((), {}, {}).message
    assert "has sent nothing" not in message
    assert "their stamps are zero: set header.stamp to the time of capture" in message


def test_a_camera_is_not_said_to_have_wrong_stamps_once_it_sees_nobody():
    _, _, skeletons, _ = moving_wearer(4.0)
    reporter, reader = reporter_of(skeletons[:-64])
    later = [sample for sample in skeletons[-64:] if sample.sensor == "right"]

    def said(left_sends):
        """What is said after some checks, while the right camera goes on."""
        for _ in range(6):
            left_sends()
            reader.watch.note_frame("right", later[:1])
            reporter._pipeline.add([later.pop(0)])
            reporter.check()
        return reporter.report((), {}, {}).message

    def zero_stamps():
        for _ in range(10):
            reader.check.skeleton(replace(skeletons[0], sensor="left", stamp_ns=0), NOW_NS, {})
        reader.watch.note_trouble("left", IMPLAUSIBLE)

    assert "left is not used: its stamps are zero" in said(zero_stamps)
    message = said(lambda: reader.watch.note_frame("left", ()))
    assert "stamps are zero" not in message
    assert "left does not show the subject: it sees nobody" in message


def test_views_that_are_apart_are_reported_until_only_one_camera_sees():
    _, _, skeletons, _ = moving_wearer(4.0)
    moved = [
        replace(s, positions=s.positions + [0.0, 0.2, 0.0]) if s.sensor == "right" else s
        for s in skeletons
    ]
    reporter, _ = reporter_of(moved[:-40])
    for index, sample in enumerate(moved[-40:]):
        reporter._pipeline.add([sample])
        if index % 8 == 0:
            reporter.check()
    assert "m apart: calibrate again if one has been moved" in reporter.report((), {}, {}).message
    later = [replace(s, stamp_ns=s.stamp_ns + 4 * NS_PER_S) for s in moved if s.sensor == "left"]
    for sample in later[:30]:
        reporter._pipeline.add([sample])
    reporter.check()
    assert "m apart" not in reporter.report((), {}, {}).message


def test_imus_are_called_late_only_once_the_delay_is_known(monkeypatch):
    reporter, _ = reporter_of(moving_wearer(2.0)[2])
    for stddev_s, is_named in ((0.058, False), (0.01, True)):
        delays = {"left": (-0.05, stddev_s), "right": (0.02, 0.01)}
        monkeypatch.setattr(Pipeline, "tracker_delays_s", delays)
        reporter.check()
        message = reporter.report((), {}, {}).message
        assert ("IMUs' samples come about 50 ms later" in message) == is_named


def test_without_imus_it_is_said_that_poses_are_before_the_reference_s_stamps():
    reporter, _ = reporter_of(moving_wearer(3.0)[2])
    reporter.check()
    assert "reference's stamps" not in reporter.report((), {}, {}).message
    reporter._pipeline.use_clocks({"right": Clock(offset_ns=-60_000_000)})
    report = reporter.report((), {}, {})
    assert report.message.startswith("tracking; poses: 42 ms before the reference's stamps")
    assert report.values["reference_delay_ms"] == "42"
    assert report.level == Level.OK


def test_skeletons_that_are_held_back_are_not_called_nobody():
    _, _, skeletons, _ = moving_wearer(4.0)
    reporter, _ = reporter_of(skeletons)
    reporter.check()
    for sample in skeletons[-6:]:
        far = replace(sample, stamp_ns=sample.stamp_ns + 3 * NS_PER_S, person="back")
        reporter._pipeline.add([replace(far, positions=far.positions + [1.0, 0.0, 0.0])])
    for _ in range(5):
        reporter.check()
    assert reporter.report((), {}, {}).message.startswith(UNDECIDED)


def test_what_is_wrong_with_simulated_time_is_the_only_remark():
    reporter, _ = reporter_of(moving_wearer(2.0)[2])
    report = reporter.report(("back",), {}, {}, {}, "/clock stands still")
    assert report.message.endswith("; use_sim_time is true, and /clock stands still")
    assert report.level == Level.WARN


def test_frames_that_always_come_too_late_are_named():
    skeletons = moving_wearer(3.0)[2]
    reporter, _ = reporter_of(skeletons)
    later = moving_wearer(6.0)[2][len(skeletons) :]
    left, right = ([s for s in later if s.sensor == name] for name in ("left", "right"))
    for k in range(10, len(left)):
        reporter._pipeline.add([left[k]])
        reporter._pipeline.add([right[k - 10]])
        if k % 15 == 0:
            reporter.check()
    assert "frames of cameras come too long after newer ones" in reporter.report((), {}, {}).message


def test_joints_that_a_camera_holds_are_named():
    skeletons = moving_wearer(4.0)[2]
    hand = JOINT_INDEX["left_hand"]
    held = None
    for k, sample in enumerate(skeletons):
        if sample.sensor == "right" and k > len(skeletons) // 2:
            held = sample.positions[hand] if held is None else held
            positions = sample.positions.copy()
            positions[hand] = held
            skeletons[k] = replace(sample, positions=positions)
    reporter, _ = reporter_of(skeletons)
    reporter.check()
    report = reporter.report((), {}, {})
    assert "right holds left_hand: it repeats their positions" in report.message
    assert report.level == Level.WARN
