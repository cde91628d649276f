"""The IMUs' calibration on the synthetic person, misaligned by 15 to 30 degrees."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_bench.sessions import SessionSpec, bench_session
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.imu_calibration import ImuCalibration, Phase
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.streams.samples import ImuSample, block_of, joined
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


def calibrated(session, change=lambda sample: sample, until_s=60.0, **parameters):
    """The calibration after a session whose IMU samples were changed."""
    calibration = ImuCalibration(ImuCalibrationParameters(**parameters), session.extrinsics)
    begin_ns = session.samples[0].stamp_ns
    since_frame = []
    for sample in session.samples:
        if sample.stamp_ns - begin_ns > until_s * 1e9:
            break
        if isinstance(sample, ImuSample):
            changed = change(sample)
            since_frame += [] if changed is None else [block_of(changed)]
            continue
        if since_frame:
            calibration.add(joined(since_frame))
            since_frame = []
        calibration.add(sample)
    return calibration


@pytest.fixture(scope="module")
def result(session):
    return calibrated(session).finish()


def turned(R, segment):
    """Changes one IMU's orientation: turned by R in its world."""

    def change(sample):
        if sample.segment != segment:
            return sample
        return replace(sample, orientation=(R * Rotation.from_quat(sample.orientation)).as_quat())

    return change


def test_straps_are_found_to_three_degrees_about_every_axis_that_has_moved(result, true_alignments):
    assert len(result.alignments) == 9
    errors, deviations = [], []
    for segment, alignment in result.alignments.items():
        found = Rotation.from_matrix(alignment.R_sensor_segment)
        errors.append(np.degrees((true_alignments[segment].inv() * found).as_rotvec()))
        deviations.append(np.degrees(alignment.stddev))
    errors, deviations = np.abs(errors), np.array(deviations)
    is_excited = deviations < 3.0
    assert is_excited.sum() >= 20
    assert errors[is_excited].max() < 3.0
    assert np.all(errors < 3.0 * deviations)  # the rest is called uncertain


def test_sensors_as_they_should_be_have_no_faults(result):
    assert result.faults == []
    assert [remark for remark in result.remarks if "upside down" in remark.text] == []


def test_exchanged_sensors_are_named(session):
    def exchange(sample):
        return replace(sample, segment=NAMES.get(sample.segment, sample.segment))

    faults = calibrated(session, exchange).finish().faults
    assert [fault.segments for fault in faults] == [("left_forearm", "left_thigh")]
    assert "exchanged" in faults[0].text


def test_a_sensor_on_the_table_is_named_and_left_out(session):
    def lie(sample):
        if sample.segment != "right_thigh":
            return sample
        return replace(
            sample, orientation=np.array([0.6, 0.0, 0.0, 0.8]), angular_velocity=np.zeros(3)
        )

    result = calibrated(session, lie).finish()
    (fault,) = result.faults
    assert fault.segments == ("right_thigh",)
    assert "does not move" in fault.text
    assert "right_thigh" not in result.usable


def test_a_sensor_whose_world_is_upside_down_is_named(session):
    down = turned(Rotation.from_matrix(np.diag([1.0, -1.0, -1.0])), "right_forearm")
    (fault,) = calibrated(session, down).finish().faults
    assert fault.segments == ("right_forearm",)
    assert "upside down" in fault.text


def test_a_sensor_strapped_on_upside_down_is_remarked_and_allowed_for(session, result):
    flip = Rotation.from_euler("x", 180.0, degrees=True)

    def strapped(sample):
        if sample.segment != "left_shank":
            return sample
        orientation = (Rotation.from_quat(sample.orientation) * flip).as_quat()
        rate = flip.inv().apply(sample.angular_velocity)
        return replace(sample, orientation=orientation, angular_velocity=rate)

    other = calibrated(session, strapped).finish()
    assert other.faults == []
    (remark,) = [remark for remark in other.remarks if "upside down" in remark.text]
    assert remark.segments == ("left_shank",)
    expected = flip.inv().as_matrix() @ result.alignments["left_shank"].R_sensor_segment
    np.testing.assert_allclose(other.alignments["left_shank"].R_sensor_segment, expected, atol=1e-3)


def test_worlds_that_are_turned_make_no_difference(session, result):
    offsets_deg = {"left_upper_arm": 90.0, "right_thigh": 180.0, "right_forearm": -90.0}

    def each_by_itself(sample):
        offset_deg = offsets_deg.get(sample.segment, 0.0)
        return turned(Rotation.from_euler("z", offset_deg, degrees=True), sample.segment)(sample)

    other = calibrated(session, each_by_itself).finish()
    assert other.faults == []
    for segment, alignment in result.alignments.items():
        found = other.alignments[segment].R_sensor_segment
        np.testing.assert_allclose(found, alignment.R_sensor_segment, atol=1e-3)


def test_a_sensor_that_must_be_worn_but_is_silent_is_named(session):
    def silent(sample):
        return None if sample.segment == "torso" else sample

    calibration = calibrated(session, silent, worn=("torso", "left_thigh"))
    assert "torso" in calibration.missing or calibration.result is not None
    assert [fault.segments for fault in calibration.finish().faults] == [("torso",)]


def test_it_leads_from_standing_through_moving_to_done(session):
    assert calibrated(session, until_s=1.0).phase is Phase.STAND
    moving = calibrated(session, until_s=12.0)
    assert moving.phase is Phase.MOVE
    assert 0.2 < moving.progress < 1.0
    assert "known to" in moving.missing or "moved alike" in moving.missing
    done = calibrated(session, collect_duration=15.0)
    assert done.phase is Phase.DONE
    assert (done.progress, done.missing) == (1.0, "")


def test_segments_with_too_little_motion_are_named_with_an_instruction(session):
    still = calibrated(session, until_s=15.0, enough_stddev=0.03).finish()
    texts = {remark.segments[0]: remark.text for remark in still.remarks}
    assert "kick the heel back" in texts["left_shank"]


def test_a_recording_without_an_n_pose_is_refused(session):
    late = replace(session, samples=session.samples[len(session.samples) // 2 :])
    with pytest.raises(
        CalibrationError, match=r"found no N-pose: stand still.* align the IMUs from motion"
    ):
        calibrated(late).finish()


def test_too_little_motion_is_refused(session):
    with pytest.raises(CalibrationError, match=r"expected 8\.0 s of motion or more"):
        calibrated(session, until_s=6.0).finish()
