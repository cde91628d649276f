from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from pose_core.estimators.zhang2015 import fuse_limb, fuse_trunk, minimum_variance_weights
from pose_core.imu.imu_history import ImuHistory
from pose_core.imu.imu_set import ImuSet
from pose_core.streams.samples import ImuSample, block_of, joined

MS = 1_000_000


def sample(stamp_ns, rotation, rate=(0.0, 0.0, 0.0)):
    return ImuSample(
        stamp_ns=stamp_ns,
        segment="torso",
        orientation=rotation.as_quat(),
        orientation_stddev=np.full(3, 0.02),
        angular_velocity=np.array(rate),
    )


def test_weights_minimise_the_variance():
    weights = minimum_variance_weights(0.04, 0.01, is_tracked=True)
    assert weights.kinect == pytest.approx(0.2)
    assert weights.imu == pytest.approx(0.8)
    assert weights.variance == pytest.approx(0.008)


def test_an_untracked_segment_has_full_imu_weight():
    weights = minimum_variance_weights(1e-6, 0.5, is_tracked=False)
    assert (weights.kinect, weights.imu, weights.variance) == (0.0, 1.0, 0.5)


def test_the_fused_trunk_lies_on_the_geodesic_between_both_attitudes():
    kinect = Rotation.from_rotvec([0.0, 0.2, 0.1])
    imu = Rotation.from_rotvec([0.1, 0.0, 0.4])
    fused = Rotation.from_matrix(fuse_trunk(kinect.as_matrix(), imu.as_matrix(), 0.3))
    expected = Slerp([0.0, 1.0], Rotation.concatenate([kinect, imu]))(0.3)
    assert (fused.inv() * expected).magnitude() < 1e-12


def test_a_limbs_direction_is_weighted_and_its_axial_rotation_comes_from_the_imu():
    imu = Rotation.from_euler("yxz", [0.3, -0.2, 0.9])
    kinect = Rotation.from_euler("yxz", [0.5, -0.2, -0.7])
    fused = fuse_limb(kinect.as_matrix(), imu.as_matrix(), 0.25)
    angle = np.arccos(kinect.as_matrix()[:, 2] @ imu.as_matrix()[:, 2])
    assert np.arccos(fused[:, 2] @ kinect.as_matrix()[:, 2]) == pytest.approx(0.25 * angle)
    turn = (Rotation.from_matrix(fused) * imu.inv()).as_rotvec()
    assert abs(turn @ imu.as_matrix()[:, 2]) < 1e-12  # no turn about the limb


def test_with_full_imu_weight_a_limb_has_the_imus_attitude():
    imu, kinect = Rotation.from_rotvec([0.3, 0.1, 0.8]), Rotation.from_rotvec([0.0, 0.4, 0.0])
    fused = fuse_limb(kinect.as_matrix(), imu.as_matrix(), 1.0)
    np.testing.assert_allclose(fused, imu.as_matrix(), atol=1e-12)


def tracks_of(*samples):
    tracks = ImuHistory()
    for each in samples:
        assert tracks.add(block_of(each)) == 0
    return tracks


def only(states):
    (R,), (rate,) = states.R_world_sensor, states.angular_velocity
    return Rotation.from_matrix(R), rate


def test_the_imu_history_interpolates_between_samples():
    tracks = tracks_of(
        sample(0, Rotation.identity(), (0.0, 0.0, 1.0)),
        sample(10 * MS, Rotation.from_rotvec([0.0, 0.0, 0.1]), (0.0, 0.0, 3.0)),
    )
    read, rate = only(tracks.at(4 * MS))
    np.testing.assert_allclose(read.as_rotvec(), [0.0, 0.0, 0.04], atol=1e-12)
    np.testing.assert_allclose(rate, [0.0, 0.0, 1.8])


def test_a_missing_sample_is_extrapolated_by_the_gyroscope():
    tracks = tracks_of(sample(0, Rotation.from_rotvec([0.3, 0.0, 0.0]), (0.0, 2.0, 0.0)))
    read, _ = only(tracks.at(50 * MS))
    expected = Rotation.from_rotvec([0.3, 0.0, 0.0]) * Rotation.from_rotvec([0.0, 0.1, 0.0])
    assert (read.inv() * expected).magnitude() < 1e-12


def test_a_rate_is_extrapolated_linearly_until_the_next_sample():
    def about_z(stamp_ns):  # from rest, by 20 rad/s²
        t = stamp_ns * 1e-9
        return sample(stamp_ns, Rotation.from_rotvec([0.0, 0.0, 10.0 * t * t]), (0, 0, 20.0 * t))

    read, rate = only(tracks_of(*(about_z(each * MS) for each in range(0, 50, 10))).at(55 * MS))
    np.testing.assert_allclose(rate, [0.0, 0.0, 1.1])
    np.testing.assert_allclose(read.as_rotvec(), [0.0, 0.0, 10.0 * 0.055**2], atol=1e-12)


def test_the_imu_history_has_no_value_in_a_gap_or_after_a_dropout():
    tracks = tracks_of(sample(0, Rotation.identity()))
    assert not tracks.at(200 * MS)
    tracks.add(block_of(sample(500 * MS, Rotation.identity())))
    assert not tracks.at(250 * MS)


def test_the_imu_history_rejects_repeated_stamps_and_restarts_after_a_clock_reset():
    tracks = tracks_of(sample(10_000 * MS, Rotation.identity()))
    again = [sample(stamp * MS, Rotation.identity()) for stamp in (10_000, 9_990, 100)]
    assert [tracks.add(block_of(each)) for each in again] == [1, 1, 0]
    assert tracks.newest_ns("torso") == 100 * MS


def test_a_block_of_samples_equals_single_samples():
    rng = np.random.default_rng(3)
    samples = [
        replace(sample(k * 7 * MS, Rotation.random(random_state=rng)), segment=f"segment_{k % 3}")
        for k in range(1200)
    ]
    together = ImuHistory()
    together.add(joined(samples))
    one_by_one = tracks_of(*samples)
    for stamp_ns in (8393 * MS, 8300 * MS, 8400 * MS):
        states, same = one_by_one.at(stamp_ns), together.at(stamp_ns)
        assert states.segments == same.segments
        np.testing.assert_array_equal(same.R_world_sensor, states.R_world_sensor)


def test_an_imu_without_samples_for_a_fifth_of_a_second_is_silent():
    history = ImuHistory()
    still = Rotation.identity()
    both = [replace(sample(1000 * MS, still), segment=name) for name in ("torso", "head")]
    for each in [*both, sample(1300 * MS, still)]:
        history.add(block_of(each))

    assert history.silent(1150 * MS) == ()
    assert history.silent(1300 * MS) == ("head",)
    assert history.silent(1600 * MS) == ("head", "torso")


def test_an_imu_of_four_samples_a_second_is_steadily_slow_and_never_silent_or_used():
    imus, states = ImuSet(), set()
    for k in range(0, 10_000, 250):
        imus.add(block_of(sample(k * MS, Rotation.identity())))
        if k > 1000:
            states |= {
                (
                    tuple(imus.history.slow),
                    imus.silent((k + later) * MS),
                    imus.read((k + later) * MS).segments,
                )
                for later in range(0, 250, 25)
            }
    assert states == {(("torso",), (), ())}
    assert imus.history.slow["torso"] == pytest.approx(4.0)


def test_an_imu_is_not_slow_after_a_silence_or_once_it_is_set_to_a_higher_rate():
    history = tracks_of(*(sample(k * MS, Rotation.identity()) for k in (0, 10, 20, 30, 1500, 1510)))
    assert not history.slow
    for k in (1760, 2010, 2260, 2510, 2760, 3010):
        history.add(block_of(sample(k * MS, Rotation.identity())))
    assert history.slow
    for k in range(3020, 3100, 10):
        history.add(block_of(sample(k * MS, Rotation.identity())))
    assert not history.slow


@pytest.mark.parametrize("per_block", [1, 7, 1000], ids=["single", "few", "all"])
def test_silences_are_named_with_their_times_however_samples_come_in_blocks(per_block):
    times = [k for k in range(200, 12_000, 10) if not (3000 < k < 5500 or 6000 < k < 6250)]
    samples = [sample((50_000 + k) * MS, Rotation.identity()) for k in times]
    imus = ImuSet()
    for first in range(0, len(samples), per_block):
        imus.add(joined(samples[first : first + per_block]))
    segment = samples[0].segment
    assert (
        imus.silence(segment, 50_000 * MS, 62_000 * MS)
        == "without usable samples from 3.0 to 5.5 s"
    )
    assert imus.silence(segment, 48_000 * MS, 64_000 * MS) == (
        "without usable samples from 0.0 to 2.2 s, from 5.0 to 7.5 s, from 14.0 s on"
    )


def test_samples_and_blocks_are_joined_in_their_order():
    some = [sample(k * MS, Rotation.identity()) for k in range(4)]
    block = joined([some[0], joined(some[1:3]), some[3]])
    assert block.stamps_ns.tolist() == [each.stamp_ns for each in some]
