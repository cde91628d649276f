import numpy as np
import pytest

from pose_core.body.joint_angles import ANGLES
from pose_core.streams.angle_series import AngleSeries
from pose_evaluation.gait_cycles import cycle_curves, find_cycles
from pose_evaluation.range_of_motion import ranges_of_motion, smoothed, symmetry_index_percent

RATE = 50.0


def angles(duration_s=20.0, **courses):
    """Angles [deg] as functions of time [s]; those not named are zero."""
    times = np.arange(0.0, duration_s, 1.0 / RATE)
    return AngleSeries(
        stamps_ns=np.round(times * 1e9).astype(np.int64),
        angles={
            name: np.radians(courses[name](times)) if name in courses else np.zeros(len(times))
            for name in ANGLES
        },
    )


def wave(period_s, amplitude=30.0, phase=0.0):
    return lambda t: amplitude * (1.0 - np.cos(2.0 * np.pi * t / period_s + phase))


def test_cycles_of_a_steady_march_are_counted_and_timed():
    marching = angles(left_knee_flexion=wave(1.25), right_knee_flexion=wave(1.25, phase=np.pi))
    found = find_cycles(marching)
    assert found["left"].angle == "left_knee_flexion"
    assert found["right"].angle == "right_knee_flexion"
    assert len(found["left"].begin_ns) == 15  # peaks at 0.625 + 1.25 k, of which 16 are whole
    np.testing.assert_allclose(found["left"].durations_s, 1.25, atol=0.02)


def test_curves_go_from_peak_to_peak_with_the_spread_between_cycles():
    growing = angles(left_knee_flexion=lambda t: (1.0 + t / 100.0) * wave(1.0, 20.0)(t))
    cycles = find_cycles(growing)["left"]
    curve = cycle_curves(growing, cycles)["left_knee_flexion"]
    assert curve.cycles == len(cycles.begin_ns)
    assert curve.mean_deg[0] > curve.mean_deg[50] + 30.0
    assert curve.sd_deg[0] > 5.0 * max(curve.sd_deg[50], 0.01)
    assert curve.range_mean_deg == pytest.approx(40.0 * 1.1, rel=0.05)


def test_a_still_side_has_no_cycles():
    assert set(find_cycles(angles(left_hip_flexion=wave(1.0)))) == {"left"}


def test_two_repeats_are_no_rhythm():
    twice = angles(duration_s=6.0, left_knee_flexion=wave(2.5))
    assert find_cycles(twice) == {}


def test_movements_of_random_length_are_no_cycles():
    rng = np.random.default_rng(2)
    moments = np.cumsum(rng.uniform(0.7, 6.5, 8))

    def bumps(t):
        return sum(40.0 * np.exp(-(((t - m) / 0.2) ** 2)) for m in moments)

    assert "left" not in find_cycles(angles(duration_s=40.0, left_knee_flexion=bumps))


def test_a_long_pause_between_two_bouts_is_no_cycle():
    def bouts(t):
        resting = (t > 6.0) & (t < 14.0)
        return np.where(resting, 0.0, wave(1.0)(t))

    cycles = find_cycles(angles(left_knee_flexion=bouts))["left"]
    assert cycles.durations_s.max() < 1.2
    assert len(cycles.begin_ns) == 10


def test_raised_arms_are_cycles_too():
    found = find_cycles(angles(duration_s=30.0, right_shoulder_abduction=wave(4.0, 40.0)))
    assert found["right"].angle == "right_shoulder_abduction"


def test_gaps_in_a_curve_leave_that_cycle_out():
    marching = angles(left_knee_flexion=wave(1.0))
    cycles = find_cycles(marching)["left"]
    seen_from_one_side = angles(left_knee_flexion=wave(1.0))
    seen_from_one_side.angles["left_knee_flexion"][200:260] = np.nan
    curve = cycle_curves(seen_from_one_side, cycles)["left_knee_flexion"]
    assert curve.cycles == len(cycles.begin_ns) - 2


def test_range_and_peaks_are_those_of_the_motion():
    moving = angles(left_hip_flexion=lambda t: 40.0 * np.sin(2.0 * np.pi * t / 8.0) - 5.0)
    found = ranges_of_motion(moving, begin_ns=-1_000_000_000)["left_hip_flexion"]
    assert found.range_deg == pytest.approx(80.0, abs=0.2)
    assert found.highest_deg == pytest.approx(35.0, abs=0.1)
    assert found.lowest_deg == pytest.approx(-45.0, abs=0.1)
    assert found.highest_s % 8.0 == pytest.approx(3.0, abs=0.1)  # 2 s, and the second before
    assert found.lowest_s % 8.0 == pytest.approx(7.0, abs=0.1)


def test_trembling_makes_no_range():
    trembling = angles(left_elbow_flexion=lambda t: 30.0 + 3.0 * np.sin(2.0 * np.pi * 18.0 * t))
    assert ranges_of_motion(trembling, 0)["left_elbow_flexion"].range_deg < 1.0


def test_the_filter_does_not_delay():
    moving = angles(left_hip_flexion=lambda t: 30.0 * np.sin(2.0 * np.pi * t))
    stamps_ns, smooth = smoothed(moving)
    expected = 30.0 * np.sin(2.0 * np.pi * stamps_ns * 1e-9)
    inner = slice(100, -100)
    error = np.degrees(smooth["left_hip_flexion"])[inner] - expected[inner]
    assert np.abs(error).max() < 0.3


def turning(t):
    """Flexion of an arm that is raised sideways, twice, and turns once each time."""
    return 20.0 * np.sin(2.0 * np.pi * t / 5.0) + 360.0 * np.clip([t - 4.0, t - 14.0], 0, 1).sum(0)


def sideways(t):
    return np.where(((t > 3.5) & (t < 5.5)) | ((t > 13.5) & (t < 15.5)), 80.0, 20.0)


def test_flexion_of_an_arm_that_points_sideways_is_no_range():
    raised = angles(left_shoulder_flexion=turning, left_shoulder_abduction=sideways)
    flexion = ranges_of_motion(raised, 0)["left_shoulder_flexion"]
    assert flexion.range_deg == pytest.approx(40.0, abs=1.0)
    assert flexion.highest_deg == pytest.approx(20.0, abs=1.0)


def test_an_arm_that_goes_round_has_no_more_range_than_a_turn():
    whirling = angles(left_shoulder_flexion=lambda t: 180.0 * t)
    assert 300.0 < ranges_of_motion(whirling, 0)["left_shoulder_flexion"].range_deg <= 360.0


def test_what_was_never_seen_has_no_range():
    unseen = angles()
    unseen.angles["left_hip_flexion"][:] = np.nan
    assert np.isnan(ranges_of_motion(unseen, 0)["left_hip_flexion"].range_deg)


@pytest.mark.parametrize(
    ("left", "right", "expected"), [(60.0, 60.0, 0.0), (66.0, 54.0, 20.0), (30.0, 90.0, -100.0)]
)
def test_symmetry_index_is_the_difference_over_the_mean(left, right, expected):
    assert symmetry_index_percent(left, right) == pytest.approx(expected)


def test_small_movements_have_no_symmetry_index():
    assert np.isnan(symmetry_index_percent(2.0, 1.0))
