"""The fusion's report in ``/diagnostics`` (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_body import extrinsics
from worn_imus import merged, moving_wearer

from pose_core.api import PeoplePipeline, PipelineParameters
from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuSample
from pose_core.streams.stamp_judge import StampJudge
from pose_fusion.nodes.fusion_report import FusionReporter
from pose_fusion.sample_reader import COUNTS, SampleReader
from pose_node.level import Level

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
    reader = SampleReader(parameters.sensors, judge=None, counters=Counters(*COUNTS))
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


def test_sources_excluded_for_one_reason_share_a_remark():
    _, _, skeletons, _ = moving_wearer(1.0)
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    judge = StampJudge()
    for sample in skeletons:
        judge.skeleton(sample, sample.stamp_ns + 60 * NS_PER_S, {})
    reader = SampleReader(parameters.sensors, judge=judge, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    message = reporter.report((), {}, {}).message
    assert "left, right are not used: their stamps are 60.0 s behind their arrival" in message


def test_topics_with_as_many_publishers_share_a_remark():
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    reader = SampleReader(parameters.sensors, judge=None, counters=Counters(*COUNTS))
    reporter = FusionReporter(pipeline, reader)
    message = reporter.report((), {}, {}, {"a": 2, "b": 3, "c": 2}).message
    assert "2 publishers of a, c: started twice? Stop all but one; 3 publishers of b: " in message


def test_nobody_being_chosen_is_a_warning():
    _, _, skeletons, _ = moving_wearer(3.0)
    parameters = PipelineParameters()
    pipeline = PeoplePipeline(parameters, lambda body, block: None, extrinsics())
    for sample in skeletons:
        pipeline.add([sample])
    reader = SampleReader(parameters.sensors, judge=None, counters=Counters(*COUNTS))
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
