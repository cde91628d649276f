"""Sampling times of IMUs whose samples arrive in bursts."""

import numpy as np
import pytest

from pose_core.imu.burst_stamps import BurstStamps
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock

START_NS = 1_764_000_000_000_000_000


def block_at(stamps_ns):
    count = len(stamps_ns)
    return ImuBlock(
        segments=("left_thigh",),
        imu=np.zeros(count, np.int64),
        stamps_ns=np.asarray(stamps_ns, np.int64),
        orientation=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        orientation_stddev=np.full((count, 3), 0.02),
        angular_velocity=np.zeros((count, 3)),
        linear_acceleration=np.full((count, 3), np.nan),
    )


def arrival_of(sampled_s):
    """Times at which bursts of five deliver samples taken every 10 ms."""
    return np.ceil(sampled_s / 0.05 - 1e-6) * 0.05 + 6e-4 * ((np.arange(len(sampled_s)) - 1) % 5)


def restored(arrivals_s, every=25):
    bursts = BurstStamps()
    stamps_ns = START_NS + np.rint(np.asarray(arrivals_s) * NS_PER_S).astype(np.int64)
    blocks = [
        bursts.restored(block_at(stamps_ns[first : first + every]))
        for first in range(0, len(stamps_ns), every)
    ]
    return (np.concatenate([each.stamps_ns for each in blocks]) - START_NS) / NS_PER_S


@pytest.mark.parametrize("every", [1, 25])
def test_samples_of_a_burst_get_their_sampling_times(every):
    sampled = np.arange(1000) * 0.01
    arrived = arrival_of(sampled)

    found = restored(arrived, every)

    error = (found - sampled)[200:]
    assert np.std(error) < 0.001
    assert abs(np.mean(error)) < 0.006
    assert np.all(np.diff(found) > 0.0)


def test_lost_samples_hardly_shift_the_sampling_times():
    sampled = np.arange(4000) * 0.01
    arrived, is_kept = arrival_of(sampled), np.random.default_rng(2).random(4000) > 0.05

    error = (restored(arrived[is_kept]) - sampled[is_kept])[200:]

    assert np.std(error) < 0.009
    assert np.abs(error).max() < 0.04


def test_evenly_stamped_samples_are_left_alone():
    jitter = np.random.default_rng(1).normal(0.0, 0.001, 1000)
    stamps = np.arange(1000) * 0.01 + jitter
    np.testing.assert_allclose(restored(stamps), stamps, atol=1e-9)


def test_after_a_silence_the_times_are_again_near_the_arrivals():
    sampled = np.arange(1000) * 0.01
    sampled[500:] += 3.0
    arrived = arrival_of(sampled)

    error = restored(arrived) - sampled

    assert np.abs(error[520:]).max() < 0.05
    assert np.std(error[700:]) < 0.001
