"""Which estimates of a first pass hold at a recording's beginning."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pose_core.fusion.alignment_history import AlignmentHistory
from pose_core.imu.sensor_to_segment import SensorToSegment

END_S = 45.0


def alignment(angle_deg):
    R = Rotation.from_euler("x", angle_deg, degrees=True).as_matrix()
    stddev = np.radians([1.0, 1.0, 2.0])
    return SensorToSegment(R_sensor_segment=R, stddev=stddev)


def found(angle_deg):
    """Initial alignment of an IMU whose estimates [deg] are a function of time, None without."""
    history = AlignmentHistory()
    for time in np.arange(0.0, END_S, 0.1):
        angle = angle_deg(time)
        known = {} if angle is None else {"left_thigh": alignment(angle)}
        pipeline = SimpleNamespace(newest_ns=10**18 + round(time * 1e9), sensor_to_segment=known)
        history.note(pipeline)
    return history.initial(pipeline).get("left_thigh")


def degrees(alignment):
    return np.degrees(Rotation.from_matrix(alignment.R_sensor_segment).magnitude())


def aligned_anew(time):
    """It slips at 22 s, drifts, is noticed at 26 s, and aligned anew at 30 s."""
    if 26.0 < time < 30.0:
        return None
    return 0.1 if time < 22.0 else time - 22.0 if time < 26.0 else 30.0


@pytest.mark.parametrize(
    ("angle_deg", "expected"),
    [
        pytest.param(lambda time: 5.0 + 5.0 * np.exp(-time / 10.0), 5.0, id="settling"),
        pytest.param(lambda time: 40.0 if time < 14.0 else 3.0, 3.0, id="wrong at first"),
    ],
)
def test_without_a_slip_the_last_alignment_holds(angle_deg, expected):
    alignment = found(angle_deg)
    assert degrees(alignment) == pytest.approx(expected, abs=1.0)
    assert alignment.slip is None


def test_a_minute_after_the_last_imu_was_aligned_more_samples_do_not_help():
    history = AlignmentHistory()
    complete_s = []
    for time in np.arange(0.0, 100.0, 0.5):
        known = {"left_thigh": alignment(1.0)} if time >= 5.0 else {}
        known |= {"trunk": alignment(2.0)} if time >= 20.0 else {}
        stamp_ns = 10**18 + round(time * 1e9)
        history.note(SimpleNamespace(newest_ns=stamp_ns, sensor_to_segment=known))
        complete_s += [time] * history.is_complete
    assert complete_s[0] == pytest.approx(80.0, abs=1.0)


@pytest.mark.parametrize(
    ("angle_deg", "after", "slip_s"),
    [
        pytest.param(aligned_anew, 30.0, 22.0, id="aligned anew"),
        pytest.param(lambda time: max(0.1, 2.0 * (time - 25.0)), 40.0, 29.0, id="unnoticed"),
    ],
)
def test_the_alignment_of_before_a_slip_holds_until_it(angle_deg, after, slip_s):
    alignment = found(angle_deg)
    assert degrees(alignment) == pytest.approx(0.1, abs=0.1)
    assert degrees(alignment.slip.after) == pytest.approx(after, abs=1.0)
    begin_s, end_s = (
        (ns - 10**18) * 1e-9 for ns in (alignment.slip.begin_ns, alignment.slip.end_ns)
    )
    assert begin_s < slip_s < end_s < begin_s + 16.0


def test_an_imu_that_is_lost_has_the_alignment_of_ten_seconds_before():
    alignment = found(lambda time: 10.0 if time < 34.0 else 16.0 if time < 40.0 else None)
    assert degrees(alignment) == pytest.approx(10.0)


def test_an_imu_that_is_soon_lost_has_no_alignment():
    assert found(lambda time: 10.0 if time < 8.0 else None) is None
