"""Sources on other clocks: their stamps are put right before anything else is made of them."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_body import extrinsics, kinematics, motion, skeleton_samples

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.streams.clocks import (
    IMUS,
    ONE_IMU,
    Clock,
    block_on_reference_clock,
    on_reference_clock,
    reference_delay_s,
)
from pose_core.streams.recording_order import in_order
from pose_core.streams.samples import ImuSample, joined

DRIFT = 1e-4
CLOCKS = {
    "right": Clock(offset_ns=80_000_000, drift=DRIFT, at_ns=10**18),
    IMUS: Clock(offset_ns=-350_000_000),
}


def stamped_by(clock, sample):
    """A sample as its own clock stamps it: the inverse of what the fusion does."""
    stamp_ns = sample.stamp_ns
    for _ in range(3):
        stamp_ns = sample.stamp_ns + clock.ahead_ns(stamp_ns)
    return replace(sample, stamp_ns=stamp_ns)


@pytest.fixture(scope="module")
def samples():
    _, dof = motion(5.0)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(5), 0.005)
    imus = [
        ImuSample(
            stamp_ns=one.stamp_ns - 4_000_000,
            segment="torso",
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
            orientation_stddev=np.full(3, 0.02),
            angular_velocity=np.zeros(3),
        )
        for one in skeletons
    ]
    return [one for pair in zip(imus, skeletons, strict=True) for one in pair]


def run(samples, clocks, estimator="default"):
    placed = replace(extrinsics(), clocks=clocks)
    pipeline = Pipeline(PipelineParameters(estimator=estimator), placed)
    return [each for one in samples for each in pipeline.add(one)] + pipeline.flush()


@pytest.mark.parametrize("estimator", ["default", "li2020"])
def test_known_clock_offsets_leave_the_estimates_unchanged(samples, estimator):
    late = [
        stamped_by(CLOCKS.get(IMUS if isinstance(one, ImuSample) else one.sensor, Clock()), one)
        for one in samples
    ]
    right, put_right = run(samples, {}, estimator), run(late, CLOCKS, estimator)
    assert len(right) == len(put_right) > 50
    for a, b in zip(right, put_right, strict=True):
        assert a.stamp_ns == b.stamp_ns
        np.testing.assert_array_equal(a.position, b.position)


def test_the_clock_of_a_single_imu_is_relative_to_the_others():
    one = ImuSample(
        stamp_ns=10**18,
        segment="torso",
        orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        orientation_stddev=np.full(3, 0.02),
        angular_velocity=np.zeros(3),
    )
    block = joined([one, replace(one, segment="head")])
    clocks = {IMUS: Clock(offset_ns=5), f"{ONE_IMU}head": Clock(offset_ns=-100_000_000)}
    stamps_ns = block_on_reference_clock(block, clocks).stamps_ns - 10**18
    assert dict(zip(block.segments, stamps_ns.tolist(), strict=True)) == {
        "torso": -5,
        "head": 99_999_995,
    }


def test_a_single_imus_clock_leaves_the_estimates_unchanged_and_is_named(samples):
    clocks = {f"{ONE_IMU}torso": Clock(offset_ns=150_000_000, stddev_s=0.02)}
    early = [
        replace(one, stamp_ns=one.stamp_ns + 150_000_000) if isinstance(one, ImuSample) else one
        for one in samples
    ]
    right = run(list(in_order(samples, {})), {})
    put_right = run(list(in_order(early, clocks)), clocks)
    assert [each.stamp_ns for each in right] == [each.stamp_ns for each in put_right]
    for a, b in zip(right, put_right, strict=True):
        np.testing.assert_array_equal(a.position, b.position)
    pipeline = Pipeline(PipelineParameters(), replace(extrinsics(), clocks=clocks))
    for one in early:
        pipeline.add(one)
    remark = "its clock is 0.15 ± 0.02 s ahead of the others': corrected"
    assert pipeline.imu_uses[0].remark == remark


def test_clocks_can_be_set_while_the_pipeline_runs(samples):
    skeletons = [one for one in samples if not isinstance(one, ImuSample)]
    late = [stamped_by(CLOCKS["right"], one) if one.sensor == "right" else one for one in skeletons]
    pipeline = Pipeline(PipelineParameters(estimator="li2020"), extrinsics())
    half = len(late) // 2
    for one in late[:half]:
        pipeline.add(one)
    pipeline.use_clocks(CLOCKS)
    estimates = [each for one in late[half:] for each in pipeline.add(one)]
    stamps = [each.stamp_ns for each in estimates]
    assert stamps == sorted(set(stamps))
    assert len(estimates) > 0.4 * half
    assert 0 < pipeline.aligner.counters["backward_stamp"] <= 3  # 80 ms of frames, counted


def test_clock_drift_is_not_extrapolated_far_from_its_measurement():
    clock = Clock(offset_ns=1_000, drift=1e-4, at_ns=10**18)
    assert clock.ahead_ns(10**18 + 10 * 10**9) == 1_001_000
    assert clock.ahead_ns(10**18 + 86_400 * 10**9) == 180_001_000  # half an hour of drift


def test_a_source_without_a_clock_keeps_its_stamps(samples):
    left = next(one for one in samples if getattr(one, "sensor", "") == "left")
    assert on_reference_clock(left, {"right": Clock(offset_ns=5)}) is left


def ahead(**offsets_ms):
    return {name: Clock(offset_ns=offset * 1_000_000) for name, offset in offsets_ms.items()}


@pytest.mark.parametrize(
    ("clocks", "delay_s"),
    [
        ({}, 0.0),
        (ahead(right=-20), 0.0166),  # the right tracker is earlier: the left one is late
        (ahead(right=-60), 0.0424),  # or the clocks differ
        (ahead(right=60), 0.0),
        (ahead(right=30, back=-40), 0.0313),
        (ahead(right=-300), 0.0),  # no tracker is as late: the clocks differ
        (ahead(imus=-60), 0.0),
        ({f"{ONE_IMU}torso": Clock(offset_ns=-60_000_000)}, 0.0),
    ],
)
def test_the_references_tracker_is_probably_late_where_another_camera_is_earlier(clocks, delay_s):
    assert reference_delay_s(clocks) == pytest.approx(delay_s, abs=1e-4)


def test_the_pose_is_published_for_when_the_body_was_probably_there(samples):
    skeletons = [one for one in samples if not isinstance(one, ImuSample)]
    early = ahead(right=-60)["right"]
    stamped = [stamped_by(early, s) if s.sensor == "right" else s for s in skeletons]
    placed = replace(extrinsics(), clocks={"right": early})
    parameters = PipelineParameters(output_rate=0.0)
    pipeline, plain = Pipeline(parameters, placed), Pipeline(parameters, extrinsics())
    late = [e.stamp_ns for one in stamped for e in pipeline.add(one)]
    in_time = [e.stamp_ns for one in skeletons for e in plain.add(one)]
    earlier_ns = 1e9 * reference_delay_s(placed.clocks)
    assert late[-1] == pytest.approx(in_time[-1] - earlier_ns, abs=1000)
