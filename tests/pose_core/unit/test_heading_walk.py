"""The walk of an IMU's heading is measured against its gyroscope."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from turning_imus import PERIOD_S, START_NS, block, turning

from pose_core.imu.heading_walk import DISTURBED, SOUND, HeadingWalks
from pose_core.imu.imu_set import ImuSet


def walks_of(headings_deg, rates_off=0.0, seconds=40.0, tissue=0.0):
    """Walks of an IMU that turns while its reference frame turns about the vertical."""
    orientations, rates = turning(seconds)
    rng = np.random.default_rng(3)
    loose = Rotation.from_rotvec(tissue * rng.standard_normal((len(rates), 3)))
    world = Rotation.from_euler(
        "z", headings_deg(np.arange(len(rates)) * PERIOD_S)[:, None], degrees=True
    )
    walks = HeadingWalks()
    walks.add(block(world * orientations * loose, rates + rates_off))
    return walks


@pytest.mark.parametrize("bias_deg_s", [0.0, 1.0])
def test_a_steady_drift_and_soft_tissue_are_no_walk(bias_deg_s):
    steady = walks_of(lambda t: 0.3 * t, rates_off=np.radians([bias_deg_s, 0.0, 0.0]), tissue=0.03)
    assert not steady.unsound


def test_an_uneven_field_is_found():
    uneven = walks_of(lambda t: 12.0 * np.sin(0.7 * t))
    assert uneven.disturbed["torso"] == pytest.approx(np.radians(8.0), rel=0.3)
    assert SOUND < DISTURBED < uneven.unsound["torso"]


def test_a_random_walk_is_measured_however_samples_come_in_blocks():
    rng = np.random.default_rng(5)
    steps = 5.0 * np.sqrt(PERIOD_S) * rng.standard_normal(20_000)
    orientations, rates = turning(200.0)
    world = Rotation.from_euler("z", np.cumsum(steps)[:, None], degrees=True)
    given = block(world * orientations, rates)
    at_once, in_parts = HeadingWalks(), HeadingWalks()
    at_once.add(given)
    for first in range(0, len(given), 7):
        in_parts.add(given.rows(slice(first, first + 7)))
    assert at_once.disturbed == in_parts.disturbed
    assert at_once.disturbed["torso"] == pytest.approx(np.radians(5.0), rel=0.3)


def test_gaps_and_a_gyroscope_at_rest_are_no_walk():
    orientations, rates = turning(60.0)
    silent = np.r_[0:1500, 2000:3000, 3500:6000]
    dead = rates.copy()
    dead[1000:1400] = 0.0
    walks = HeadingWalks()
    walks.add(block(orientations, dead).rows(silent))
    assert not walks.unsound


def test_samples_that_repeat_a_stamp_are_no_walk():
    orientations, rates = turning(60.0)
    given = block(orientations, rates)
    repeated = np.arange(3, len(rates), 5)
    given.stamps_ns[repeated] = given.stamps_ns[repeated - 1]
    walks = HeadingWalks()
    walks.add(given)
    assert not walks.unsound


def walk_of_bursts(lost, headings_deg):
    """Walk of an IMU whose samples arrive in bursts of five, of which some are lost."""
    rng = np.random.default_rng(5)
    orientations, rates = turning(60.0)
    world = Rotation.from_euler("z", headings_deg(rng, len(rates))[:, None], degrees=True)
    given = block(world * orientations, rates)
    number = np.arange(len(rates))
    arrived_ns = (number // 5 + 1) * 5 * round(PERIOD_S * 1e9) + number % 5 * 600_000
    given = replace(given, stamps_ns=START_NS + arrived_ns)
    imus = ImuSet()
    imus.add(given.rows(rng.random(len(rates)) >= lost))
    return imus.walks


@pytest.mark.parametrize("lost", [0.02, 0.05, 0.15])
def test_lost_samples_of_bursts_are_no_walk(lost):
    assert not walk_of_bursts(lost, lambda _, count: np.zeros(count)).unsound


def test_a_walk_is_found_though_samples_of_bursts_are_lost():
    walks = walk_of_bursts(0.05, lambda rng, count: np.cumsum(0.5 * rng.standard_normal(count)))
    assert walks.disturbed["torso"] == pytest.approx(np.radians(4.0), rel=0.3)
