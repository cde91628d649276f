"""One recording has one truth: when a run begins, and what it knew when, leaves no trace."""

from dataclasses import replace

import numpy as np
import pytest

from pose_calibration.session_calibration import calibrate
from pose_core.api import (
    Pipeline,
    PipelineParameters,
    SkeletonSample,
    joint_angles,
    series_of_estimates,
)
from pose_io.samples import read_samples

pytestmark = pytest.mark.data

RECORDING = "kinectmultitrack/Study_7_Kinect_1_Time_3_08_26_PM.csv.gz"
LATER_S = 25.0  # [s] at which the second run begins
LIVE_S = 20.0  # [s] after which a live calibration has found the extrinsics
END_S = 70.0  # [s] of the recording
SETTLED_S = 20.0  # [s]
AGREE_DEG = 2.0  # [deg] in median
LEG_BIAS_DEG = 1.0  # [deg] beyond what the two cameras see of hips and knees
ARM_BIAS_DEG = 8.5  # [deg] 1 % of a nearly straight arm's length is 5 degrees at its elbow
MIN_KNOWN = np.radians(12.0)  # [rad] a limb that is straight does not show how it is turned


@pytest.fixture(scope="module")
def recorded(shared_data):
    read = read_samples(shared_data / RECORDING)
    samples = [each for each in read.samples if isinstance(each, SkeletonSample)]
    begin_ns = samples[0].stamp_ns
    samples = [each for each in samples if each.stamp_ns - begin_ns < END_S * 1e9]
    return tuple(read.sensors), begin_ns, samples


def fused(recorded, from_s=0.0, live=False):
    """What ``./pose fuse`` makes of a recording from some instant on, or the live graph."""
    sensors, begin_ns, samples = recorded
    samples = [each for each in samples if each.stamp_ns - begin_ns >= from_s * 1e9]
    pipeline = Pipeline(PipelineParameters(sensors=sensors))
    known = samples
    if live:
        known = [each for each in samples if each.stamp_ns - begin_ns < LIVE_S * 1e9]
    extrinsics = calibrate(known, sensors).extrinsics
    if live:  # the person's measures are the fusion's own
        extrinsics = replace(extrinsics, body=None)
    estimates = []
    for sample in samples:
        if pipeline.extrinsics is None and (not live or sample.stamp_ns - begin_ns >= LIVE_S * 1e9):
            pipeline.use_extrinsics(extrinsics)
        estimates += pipeline.add(sample)
    return [*estimates, *pipeline.flush()]


@pytest.fixture(scope="module")
def whole(recorded):
    return fused(recorded)


def medians_deg(samples, joints):
    """Median of each of the twelve angles [deg] of joints, n arrays of (15, 3) [m]."""
    angles = joint_angles(np.stack(joints))
    settled = np.array([each.stamp_ns for each in samples]) > samples[0].stamp_ns + SETTLED_S * 1e9
    return {name: np.degrees(np.nanmedian(each[settled])) for name, each in angles.items()}


def test_angles_are_those_of_the_raw_joints_within_their_bias(recorded, whole):
    sensors, _, samples = recorded
    raw = []
    for sensor in sensors:
        own = [each for each in samples if each.sensor == sensor]
        raw.append(medians_deg(own, [each.positions for each in own]))
    for name, angle in medians_deg(whole, [each.joints for each in whole]).items():
        bias = ARM_BIAS_DEG if "elbow" in name or "shoulder" in name else LEG_BIAS_DEG
        between = sorted(each[name] for each in raw)
        assert between[0] - bias < angle < between[1] + bias, name


def apart_deg(one, other, begin_ns, from_s):
    """Median difference of each joint angle [deg] from some instant on, where both know it."""
    one, other = series_of_estimates(one), series_of_estimates(other)
    grid = np.arange(begin_ns + from_s * 1e9, begin_ns + (END_S - 1.0) * 1e9, 1e8)

    def at(series, values):
        return np.interp(grid - begin_ns, series.stamps_ns - begin_ns, values)

    found = {}
    for index, name in enumerate(one.names):
        if name.startswith("pelvis"):
            continue
        known = [at(each, each.position_stddev[:, index]) < MIN_KNOWN for each in (one, other)]
        angles = [at(each, each.position[:, index]) for each in (one, other)]
        both = known[0] & known[1]
        if both.mean() > 0.2:
            found[name] = float(np.degrees(np.median((angles[1] - angles[0])[both])))
    return found


def test_a_run_started_later_agrees_with_the_whole(recorded, whole):
    found = apart_deg(whole, fused(recorded, LATER_S), recorded[1], LATER_S + SETTLED_S)
    assert len(found) >= 11
    assert max(map(abs, found.values())) < AGREE_DEG, found


def test_a_live_run_agrees_with_one_calibrated_beforehand(recorded, whole):
    found = apart_deg(whole, fused(recorded, live=True), recorded[1], LIVE_S + SETTLED_S)
    assert len(found) >= 11
    assert max(map(abs, found.values())) < AGREE_DEG, found
