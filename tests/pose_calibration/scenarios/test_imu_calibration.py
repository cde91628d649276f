"""The IMUs' calibration on the synthetic person and on captured people, mounted at any angle."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_bench.captured import true_extrinsics
from pose_bench.captured_suite import captured_specs
from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.imu_calibration import ImuCalibration
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.streams.samples import ImuSample, joined
from pose_sim.captured.session import make_captured_session
from pose_sim.session import make_session, settings_of

STRAPS = {"imu": {"misalignment_min": 15.0, "misalignment_max": 30.0}}
SPEC = SessionSpec(choreography="leg_lift_march", level="typical", seed=1, duration_s=26.0)
NAMES = {"left_thigh": "left_forearm", "left_forearm": "left_thigh"}


@pytest.fixture(scope="module")
def session():
    return bench_session(SPEC, overrides=STRAPS)


@pytest.fixture(scope="module")
def true_alignments():
    settings = settings_of(SPEC.level, STRAPS)
    worn = make_session(SPEC.choreography, SPEC.duration_s, SPEC.seed, settings).nodes
    return {each.segment: each.R_segment_sensor.inv() for each in worn.values()}


def calibrated(samples, extrinsics, change=lambda sample: sample, until_s=60.0, **parameters):
    """The calibration after samples of which those of IMUs were changed."""
    calibration = ImuCalibration(ImuCalibrationParameters(**parameters), extrinsics)
    begin_ns = samples[0].stamp_ns
    since_frame = []
    for sample in samples:
        if sample.stamp_ns - begin_ns > until_s * 1e9 or calibration.is_done:
            break
        if isinstance(sample, ImuSample):
            changed = change(sample)
            since_frame += [] if changed is None else [changed]
            continue
        if since_frame:
            calibration.add(joined(since_frame))
            since_frame = []
        calibration.add(sample)
    return calibration


@pytest.fixture
def calibrate(session):
    def run(change=lambda sample: sample, **options):
        return calibrated(session.samples, session.extrinsics, change, **options)

    return run


@pytest.fixture(scope="module")
def result(session):
    return calibrated(session.samples, session.extrinsics).finish()


def test_mountings_are_found_within_their_stated_uncertainty(result, true_alignments):
    assert result.faults == []
    assert len(result.alignments) == 9
    uses = {use.segment: use for use in result.uses}
    for segment, alignment in result.alignments.items():
        found = Rotation.from_matrix(alignment.R_sensor_segment)
        x, y, z = np.abs((true_alignments[segment].inv() * found).as_rotvec())
        assert max(x, y) < 3.5 * uses[segment].tilt_stddev, segment
        assert z < 3.5 * uses[segment].turn_stddev, segment


def test_captured_people_who_never_stand_still_are_calibrated():
    spec = replace(captured_specs(None, held_out=False, seed=7)[0], duration_s=30.0)
    session = make_captured_session(spec)
    found = calibrated(session.samples(imus=True), true_extrinsics(session)).finish()
    assert found.faults == []
    assert len(found.alignments) == 9


def test_exchanged_sensors_are_named_and_left_out(calibrate):
    def exchange(sample):
        return replace(sample, segment=NAMES.get(sample.segment, sample.segment))

    found = calibrate(exchange).finish()
    assert [text.split(":")[0] for text in found.faults] == ["IMU left_forearm", "IMU left_thigh"]
    assert all("exchanged" in text for text in found.faults)
    assert len(found.alignments) == 7


def test_a_sensor_on_the_table_is_named_and_left_out(calibrate):
    def lie(sample):
        if sample.segment != "right_thigh":
            return sample
        return replace(
            sample, orientation=np.array([0.6, 0.0, 0.0, 0.8]), angular_velocity=np.zeros(3)
        )

    found = calibrate(lie).finish()
    (fault,) = found.faults
    assert fault.startswith("IMU right_thigh: it has not turned by 8° yet")
    assert "right_thigh" not in found.alignments


def test_a_sensor_whose_world_is_upside_down_is_turned_over(calibrate, result):
    flip = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))

    def down(sample):
        if sample.segment != "torso":
            return sample
        orientation = (flip * Rotation.from_quat(sample.orientation)).as_quat()
        return replace(sample, orientation=orientation)

    found = calibrate(down).finish()
    assert found.faults == []
    assert [use.segment for use in found.uses if "points down" in use.remark] == ["torso"]
    alignment, as_usual = (each.alignments["torso"] for each in (found, result))
    assert alignment.z_down
    apart = alignment.R_sensor_segment.T @ as_usual.R_sensor_segment
    assert np.degrees(Rotation.from_matrix(apart).magnitude()) < 2.0


def test_a_sensor_that_must_be_worn_but_is_silent_is_named(calibrate):
    def silent(sample):
        return None if sample.segment == "torso" else sample

    calibration = calibrate(silent, worn=("torso", "left_thigh"))
    assert calibration.missing.startswith("no samples from the IMU of torso")
    assert calibration.finish().faults == [calibration.missing]


def test_it_says_how_to_move_until_it_is_done(calibrate):
    moving = calibrate(until_s=6.0)
    assert not moving.is_done
    assert 0.0 < moving.progress < 1.0
    assert re.match(r"(lift|raise|lean) .*\((left|right|torso)", moving.missing)
    done = calibrate(collect_duration=15.0)
    assert done.is_done
    assert (done.progress, done.missing) == (1.0, "")


def test_too_little_motion_is_refused(calibrate):
    with pytest.raises(CalibrationError, match=r"expected 15\.0 s of motion or more"):
        calibrate(until_s=6.0).finish()
