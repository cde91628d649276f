"""Mapping of a sensor's clock onto the host's, on simulated clocks."""

import numpy as np
import pytest

from pose_io.recordings.clock_fit import MAX_DRIFT, fit_clock

MS = 1_000_000  # [ns]
HOST_ZERO = 1_763_697_600_123_456_789  # [ns] today's UNIX time: nothing may be lost to doubles
TICK = 15 * MS  # the host sees a frame at its next tick


def captures(seconds: float, rate_hz: float = 30.0) -> np.ndarray:
    """Moments of capture [ns since the beginning]."""
    return np.arange(0, seconds, 1 / rate_hz) * 1e9 // 1


def sensor_clock(capture: np.ndarray, drift: float, offset_ns: int = 63_664_597_590_300):
    """What the sensor's clock shows, running ``drift`` slower than the host's."""
    return np.rint(capture / (1 + drift)).astype(np.int64) + offset_ns


def arrival(capture: np.ndarray, rng: np.random.Generator, queue_ms: float = 0.0) -> np.ndarray:
    """Host time of arrival: transmission, a queue that comes and goes, the host's next tick."""
    transmission = rng.exponential(8.0, len(capture)) * MS
    swing = np.maximum(0.0, np.sin(capture * 1e-9 * 2 * np.pi / 20.0)) * queue_ms * MS
    tick = np.ceil((capture + transmission + swing) / TICK) * TICK
    return HOST_ZERO + tick.astype(np.int64)


def error_ms(fit, capture: np.ndarray) -> np.ndarray:
    """Stamp against truth; a delay common to all frames cannot be known and is left out."""
    error = (fit.capture_ns - HOST_ZERO - capture) / MS
    return error - np.median(error)


@pytest.mark.parametrize("drift_ppm", [-100.0, -20.0, 0.0, 50.0, 150.0])
def test_drift_is_found_under_ticks_and_delays(drift_ppm):
    capture = captures(120.0)
    rng = np.random.default_rng(3)

    fit = fit_clock(sensor_clock(capture, drift_ppm * 1e-6), arrival(capture, rng))

    assert fit.drift[0] * 1e6 == pytest.approx(drift_ppm, abs=15.0)
    assert np.abs(error_ms(fit, capture)).max() < 2.0


@pytest.mark.parametrize("queue_ms", [100.0, 500.0, 1500.0])
def test_a_queue_that_comes_and_goes_moves_no_stamp(queue_ms):
    capture = captures(120.0)
    rng = np.random.default_rng(4)
    host = arrival(capture, rng, queue_ms)

    fit = fit_clock(sensor_clock(capture, 40e-6), host)

    assert np.abs(error_ms(fit, capture)).max() < 3.0
    assert (fit.delay_ns >= 0).all()
    assert np.std((host - HOST_ZERO - capture) / MS) > 10 * np.std(error_ms(fit, capture))


def test_a_perfect_clock_is_reproduced_to_the_nanosecond():
    host = HOST_ZERO + captures(60.0).astype(np.int64)

    fit = fit_clock(host - HOST_ZERO, host)

    np.testing.assert_array_equal(fit.capture_ns, host)
    assert fit.outliers == 0


def test_the_drift_of_a_short_recording_stays_within_what_crystals_do():
    capture = captures(2.0)
    rng = np.random.default_rng(5)

    fit = fit_clock(
        sensor_clock(capture, 0.0), arrival(capture, rng) + (capture * 0.01).astype(int)
    )

    assert abs(fit.drift[0]) <= MAX_DRIFT
    assert np.abs(error_ms(fit, capture)).max() < 1.0


def test_a_reset_begins_an_epoch_with_a_line_of_its_own():
    capture = captures(120.0)
    rng = np.random.default_rng(6)
    sensor = sensor_clock(capture, 30e-6)
    sensor[1500:] -= sensor[1500] - 1_000  # the sensor was switched off and on

    fit = fit_clock(sensor, arrival(capture, rng))

    assert fit.epoch.tolist() == [0] * 1500 + [1] * (len(capture) - 1500)
    assert np.abs(error_ms(fit, capture)).max() < 4.0


def test_a_clock_set_forward_begins_an_epoch_too():
    capture = captures(60.0)
    rng = np.random.default_rng(7)
    sensor = sensor_clock(capture, 0.0)
    sensor[900:] += 3_600 * 1000 * MS

    fit = fit_clock(sensor, arrival(capture, rng))

    assert len(fit.drift) == 2
    assert np.abs(error_ms(fit, capture)).max() < 4.0


def test_an_epoch_goes_on_after_a_single_wrong_stamp():
    capture = captures(60.0)
    rng = np.random.default_rng(8)
    sensor = sensor_clock(capture, 0.0)
    sensor[700] = 12

    fit = fit_clock(sensor, arrival(capture, rng))

    assert np.flatnonzero(fit.epoch).tolist() == [700]
    assert np.abs(np.delete(error_ms(fit, capture), 700)).max() < 2.0


def test_a_frame_that_arrived_before_all_others_is_an_outlier_and_moves_nothing():
    capture = captures(60.0)
    rng = np.random.default_rng(9)
    host = arrival(capture, rng)
    host[800] -= 2_000 * MS

    fit = fit_clock(sensor_clock(capture, 20e-6), host)

    assert fit.outliers == 1
    assert fit.delay_ns[800] < 0
    assert np.abs(error_ms(fit, capture)).max() < 2.0


def test_the_order_of_arrival_does_not_move_stamps():
    capture = captures(30.0)
    rng = np.random.default_rng(10)
    sensor, host = sensor_clock(capture, 50e-6), arrival(capture, rng)
    order = rng.permutation(len(capture))

    straight, shuffled = fit_clock(sensor, host), fit_clock(sensor[order], host[order])

    np.testing.assert_allclose(
        (shuffled.capture_ns - straight.capture_ns[order]) / MS, 0.0, atol=0.01
    )


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_frames_are_enough(count):
    host = HOST_ZERO + np.arange(count) * 33 * MS

    fit = fit_clock(np.arange(count) * 33 * MS, host)

    np.testing.assert_allclose(fit.capture_ns - HOST_ZERO, host - HOST_ZERO, atol=1)
    assert fit.summary()["clock_epochs"] == 1
