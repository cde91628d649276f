from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imu_bridge.parameters import ImuBridgeParameters
from pose_bench.sessions import SessionSpec, bench_session
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_sim.captured.session import START_NS

SPEC = SessionSpec(choreography="kicks", level="typical", seed=4, duration_s=6.0)


@pytest.fixture(scope="module")
def session():
    return bench_session(SPEC)


def test_samples_are_in_the_order_in_which_they_arrive(session):
    assert len(session.samples) == len(session.skeletons) + len(session.imus)
    assert np.all(np.diff(session.arrivals_ns) >= 0)
    late = np.array(session.arrivals_ns) - [sample.stamp_ns for sample in session.samples]
    assert late.min() > -1_000_000
    assert late.max() < 200_000_000


def test_both_kinects_and_all_nine_imus_are_there(session):
    assert {sample.sensor for sample in session.skeletons} == {"left", "right"}
    assert len({sample.segment for sample in session.imus}) == 9
    assert len(session.skeletons) == pytest.approx(2 * 30 * 6, abs=12)
    assert len(session.imus) == pytest.approx(9 * 100 * 6, abs=20)


def test_skeletons_are_stamped_with_their_capture_plus_the_unobservable_latency(session):
    clean = bench_session(replace(SPEC, level="clean"), imus=False)
    truth = clean.truth
    for sample in clean.skeletons[10:200:20]:
        T = clean.extrinsics.T_map_sensor(sample.sensor)
        seen = sample.positions @ T[:3, :3].T + T[:3, 3]
        times = truth.stamps_ns - START_NS
        at = sample.stamp_ns - START_NS - 15_000_000
        true = np.array(
            [[np.interp(at, times, truth.positions[:, j, k]) for k in range(3)] for j in range(15)]
        )
        assert np.nanmax(np.abs(seen - true)) < 0.002


def test_imu_samples_carry_a_rotation_and_the_bridges_own_uncertainty_of_it(session):
    clean = bench_session(replace(SPEC, level="clean"))
    late = [s for s in clean.imus if s.segment == "torso" and s.stamp_ns > START_NS + 3 * 10**9]
    assert len(late) > 250
    for sample in late[::50]:
        assert np.linalg.norm(sample.orientation) == pytest.approx(1.0)
        assert sample.orientation_stddev[:2] == pytest.approx(
            ImuBridgeParameters().inclination_stddev
        )
        assert 0.0 < sample.orientation_stddev[2] < np.pi  # the magnetometer gives a heading


def test_imu_orientations_turn_as_the_segments_do():
    clean = bench_session(replace(SPEC, level="clean", choreography="twisting"))
    torso = [s for s in clean.imus if s.segment == "torso" and s.stamp_ns > START_NS + 2 * 10**9]
    turned = Rotation.from_quat([s.orientation for s in torso])
    # Worn straight and on the breastbone: its tilt is the trunk's, from hips to neck.
    joints = clean.truth.positions
    up = joints[:, JOINT_INDEX["neck"]] - joints[:, JOINT_INDEX["torso"]]
    true = np.degrees(np.arccos(up[:, 2] / np.linalg.norm(up, axis=1)))
    tilt = np.degrees(np.arccos(np.clip(turned.as_matrix()[:, 2, 2], -1.0, 1.0)))
    times = [s.stamp_ns - START_NS for s in torso]
    expected = np.interp(times, clean.truth.stamps_ns - START_NS, true)
    assert np.sqrt(np.mean((tilt - expected) ** 2)) < 3.0


def test_the_same_session_gives_the_same_samples(session):
    other = bench_session(SPEC)

    assert other.arrivals_ns == session.arrivals_ns
    for mine, theirs in zip(session.imus, other.imus, strict=True):
        assert mine.stamp_ns == theirs.stamp_ns
        assert mine.segment == theirs.segment
        assert np.array_equal(mine.orientation, theirs.orientation)


def test_a_clock_offset_is_in_the_stamps_and_in_the_true_extrinsics(session):
    late = bench_session(replace(SPEC, clock_offset_s=0.08), imus=False)

    assert late.extrinsics.clocks["right"].offset_ns == 80_000_000
    stamps = {
        name: [s.stamp_ns for s in each.skeletons if s.sensor == "right"][5:50]
        for name, each in (("as it is", session), ("late", late))
    }
    frames = np.subtract.outer(stamps["late"], stamps["as it is"]) - 80_000_000
    assert np.abs(frames).min(axis=1).max() < 1_000_000


def test_the_truth_has_100_instants_per_second(session):
    assert session.truth.positions.shape == (601, len(JOINTS), 3)
