"""The orientation filters by name: their common behaviour and their differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.filters import FILTERS
from imu_bridge.filters.heading import UNKNOWN_HEADING
from imu_bridge.filters.orientation_filter import FilterSettings, SampleRound

REAL = ("vqf", "madgwick", "imufusion")
RATE_HZ = 50.0
GRAVITY = np.array([0.0, 0.0, 9.80665])
FIELD = np.array([0.0, 22e-6, -42e-6])  # [T] in ENU


class Bench:
    """A filter, and sensors that turn as they are told."""

    def __init__(self, name: str, count: int = 1, **settings) -> None:
        self.filter = FILTERS[name](count, FilterSettings(**settings))
        self.true = [Rotation.identity() for _ in range(count)]
        self.index = np.arange(count)
        self._first = True

    def step(
        self,
        rate=(0.0, 0.0, 0.0),
        *,
        field=FIELD,
        bias=(0.0, 0.0, 0.0),
        dt: float = 1.0 / RATE_HZ,
    ) -> np.ndarray:
        count = len(self.index)
        rates = np.broadcast_to(np.asarray(rate, dtype=float), (count, 3))
        dt = 0.0 if self._first else dt
        self._first = False
        self.true = [
            R * Rotation.from_rotvec(w * dt) for R, w in zip(self.true, rates, strict=True)
        ]
        return self.filter.update(
            SampleRound(
                index=self.index,
                dt=np.full(count, dt),
                angular_velocity=rates + bias,
                acceleration=np.array([R.inv().apply(GRAVITY) for R in self.true]),
                magnetic_field=np.array([R.inv().apply(field) for R in self.true]),
                device_orientation=np.array([R.as_quat() for R in self.true]),
            )
        )

    def tumble(self, seconds: float, **options) -> np.ndarray:
        for k in range(round(seconds * RATE_HZ)):
            t = k / RATE_HZ
            rate = [np.sin(2.0 * t), 1.5 * np.cos(1.3 * t), 1.2 * np.sin(0.7 * t + 1.0)]
            q = self.step(rate, **options)
        return q

    def error_deg(self, q: np.ndarray) -> np.ndarray:
        errors = [
            (Rotation.from_quat(each) * R.inv()).magnitude()
            for each, R in zip(q, self.true, strict=True)
        ]
        return np.degrees(errors)


@pytest.mark.parametrize("name", FILTERS)
def test_a_turning_sensor_is_followed(name: str):
    bench = Bench(name, 3)
    assert bench.error_deg(bench.tumble(20.0)).max() < 2.5


@pytest.mark.parametrize("name", REAL)
def test_sensors_do_not_see_each_other(name: str):
    alone, among = Bench(name, 1), Bench(name, 4)
    np.testing.assert_allclose(among.tumble(3.0)[2], alone.tumble(3.0)[0], atol=1e-9)


# The second: cheap sensors are off so far.
@pytest.mark.parametrize("deg_s", [(0.5, -0.4, 0.3), (-3.0, 2.0, 14.0)])
@pytest.mark.parametrize("name", REAL)
def test_the_bias_of_a_resting_gyroscope_is_found(name: str, deg_s: tuple[float, ...]):
    bench, bias = Bench(name), np.radians(deg_s)
    for _ in range(600):
        bench.step(bias=bias)
    np.testing.assert_allclose(bench.filter.bias[0], bias, atol=np.radians(0.05))
    assert bench.filter.rests[0] >= 1


def test_vqf_estimates_the_bias_in_motion_until_the_first_rest():
    bench, bias = Bench("vqf"), np.radians([0.5, -0.4, 0.3])
    bench.tumble(60.0, bias=bias)
    assert bench.filter.rests[0] == 0
    np.testing.assert_allclose(bench.filter.bias[0], bias, atol=np.radians(0.2))
    for _ in range(300):
        bench.step(bias=bias)
    bench.tumble(1.0, bias=bias)  # the rest has ended
    told = bench.filter.bias.copy()
    bench.tumble(30.0, bias=3.0 * bias)  # as if motion told something else
    np.testing.assert_array_equal(bench.filter.bias, told)


@pytest.mark.parametrize("rest_s", [2.7, 3.2, 6.0])
def test_a_turn_that_begins_slowly_does_not_count_as_bias(rest_s: float):
    bench, bias = Bench("vqf"), np.radians([0.5, -0.4, 0.3])
    for _ in range(round(rest_s * RATE_HZ)):
        bench.step(bias=bias)
    for t in np.arange(0.0, 1.0, 1.0 / RATE_HZ):
        bench.step([0.0, 0.0, np.radians(2.0) * t**2], bias=bias)
    bench.tumble(3.0, bias=bias)
    np.testing.assert_allclose(bench.filter.bias[0], bias, atol=np.radians(0.02))


@pytest.mark.parametrize("name", REAL)
def test_without_a_window_of_rest_no_bias_is_estimated(name: str):
    bench = Bench(name, gyro_bias_window=0.0)
    for _ in range(600):
        bench.step(bias=np.radians([0.5, 0.0, 0.0]))
    assert not bench.filter.bias.any()


@pytest.mark.parametrize("name", REAL)
def test_with_the_magnetometer_off_the_heading_counts_as_unknown(name: str):
    bench = Bench(name, magnetometer="off")
    q = bench.tumble(5.0)
    assert bench.filter.heading_stddev[0] == UNKNOWN_HEADING
    up = Rotation.from_quat(q[0]).inv().apply([0, 0, 1])
    np.testing.assert_allclose(up, bench.true[0].inv().apply([0, 0, 1]), atol=0.04)


@pytest.mark.parametrize("name", REAL)
def test_a_sensor_without_magnetometer_runs_on_six_axes(name: str):
    bench = Bench(name)
    q = bench.tumble(5.0, field=np.full(3, np.nan))
    assert np.isfinite(q).all()
    assert bench.filter.heading_stddev[0] == UNKNOWN_HEADING


@pytest.mark.parametrize("name", REAL)
def test_a_disturbed_field_is_rejected_and_the_heading_uncertainty_grows(name: str):
    bench = Bench(name, heading_stddev=0.05, heading_drift=0.004)
    bench.tumble(16.0)
    assert bench.filter.heading_stddev[0] == pytest.approx(0.05, abs=0.002)
    disturbed = FIELD + [40e-6, 0.0, 10e-6]
    q = bench.tumble(20.0, field=disturbed)
    assert bench.error_deg(q).max() < 3.0
    assert bench.filter.rejected[0] > 700
    assert 0.09 < bench.filter.heading_stddev[0] < 0.05 + 0.004 * 20.0 + 0.01


@pytest.mark.parametrize("name", REAL)
def test_with_the_magnetometer_on_a_disturbed_field_is_used(name: str):
    bench = Bench(name, magnetometer="on")
    bench.tumble(20.0)
    assert bench.error_deg(bench.tumble(25.0, field=FIELD + [40e-6, 0.0, 0.0])).max() > 20.0
    assert bench.filter.rejected[0] == 0


@pytest.mark.parametrize("name", REAL)
def test_with_the_magnetometer_at_the_start_no_later_field_turns_the_heading(name: str):
    bench = Bench(name, magnetometer="start")
    assert bench.error_deg(bench.tumble(12.0))[0] < 3.0
    stddev = bench.filter.heading_stddev[0]
    bent = Rotation.from_euler("z", 40.0, degrees=True).apply(FIELD)  # strength and dip stay
    assert bench.error_deg(bench.tumble(25.0, field=bent))[0] < 3.0
    assert bench.filter.heading_stddev[0] > stddev


@pytest.mark.parametrize("name", REAL)
def test_a_sensor_that_begins_anew_takes_its_heading_from_the_field_again(name: str):
    bench = Bench(name, magnetometer="start")
    bench.tumble(12.0)
    bench.filter.reset(0)
    assert bench.error_deg(bench.tumble(12.0))[0] < 3.0
    assert bench.filter.heading_stddev[0] < UNKNOWN_HEADING


@pytest.mark.parametrize("name", REAL)
def test_a_heading_comes_back_after_a_disturbance(name: str):
    bench = Bench(name)
    bench.tumble(20.0)
    bench.tumble(10.0, field=FIELD + [40e-6, 0.0, 10e-6])
    bench.tumble(40.0)
    assert bench.filter.heading_stddev[0] == pytest.approx(FilterSettings.heading_stddev, abs=0.01)


@pytest.mark.parametrize("name", REAL)
def test_a_reset_sensor_keeps_its_bias_and_not_its_orientation(name: str):
    bench, bias = Bench(name), np.radians([0.5, -0.4, 0.3])
    for _ in range(600):
        bench.step(bias=bias)
    bench.filter.reset(0)
    bench.true = [Rotation.from_euler("x", 90, degrees=True)]
    assert bench.error_deg(bench.step(bias=bias, dt=0.0)).max() < 0.5
    np.testing.assert_allclose(bench.filter.bias[0], bias, atol=np.radians(0.06))


def test_vqf_integrates_over_samples_that_were_lost():
    bench = Bench("vqf", magnetometer="off", gyro_bias_window=0.0)
    for _ in range(100):
        bench.step([0.0, 0.0, 1.0])
    q = bench.step([0.0, 0.0, 1.0], dt=0.25)  # 24 samples are missing
    assert bench.error_deg(q).max() < 0.1


@pytest.mark.parametrize("period_s", [0.004, 0.0125, 0.05])
def test_vqf_finds_out_the_period_of_a_sensor(period_s: float):
    bench = Bench("vqf")
    for k in range(round(10.0 / period_s)):
        q = bench.step([0.5, np.sin(k * period_s), 0.0], dt=period_s)
    assert bench.error_deg(q).max() < 1.5


def test_vqf_survives_first_samples_that_came_all_at_once():
    bench = Bench("vqf")
    for _ in range(20):
        bench.step(dt=1e-6)
    assert bench.error_deg(bench.tumble(10.0)).max() < 1.5


def test_the_devices_own_orientation_is_handed_on_without_a_heading():
    bench = Bench("device")
    assert bench.error_deg(bench.tumble(1.0)).max() < 1e-6
    assert bench.filter.heading_stddev[0] == UNKNOWN_HEADING
