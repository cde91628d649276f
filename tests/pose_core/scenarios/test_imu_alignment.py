"""IMUs strapped on anyhow are aligned from motion alone, and named if they are not (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import blocks_between_frames, fused
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import EVERY_SEGMENT, START_NS, imu_samples, merged, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.imu.sensor_to_segment import Slip
from pose_core.joints import JOINT_INDEX
from pose_core.streams.samples import ImuSample, SkeletonSample

DURATION_S = 26.0
STANDS_S = 4.0  # what comes before is cut off: nobody is seen to stand
JUDGED_S = 21.0
MS, S = 1_000_000, 1_000_000_000
EXCHANGED = {"left_thigh": "left_forearm", "left_forearm": "left_thigh"}
ANGLES = ("left_knee_flexion", "right_elbow_flexion", "left_hip_abduction", "right_hip_rotation")


@pytest.fixture(scope="module")
def session():
    """Times, degrees of freedom, skeletons and nine IMUs' samples of somebody who never stands."""
    t, dof = motion(DURATION_S, lean=0.3)
    positions = kinematics().pose(dof).positions
    skeletons = skeleton_samples(positions, extrinsics(), np.random.default_rng(2), 0.02)
    imus = imu_samples(t, dof, np.random.default_rng(5), segments=EVERY_SEGMENT)
    begin_ns = START_NS + STANDS_S * 1e9
    cut = [[s for s in each if s.stamp_ns > begin_ns] for each in (skeletons, imus)]
    return t, dof, *cut


def run(samples, **parameters):
    pipeline = Pipeline(PipelineParameters(**parameters), extrinsics())
    return pipeline, fused(pipeline, samples)


def uses_of(pipeline):
    return {use.segment: use for use in pipeline.imu_uses}


@pytest.fixture(scope="module")
def with_imus(session):
    _, _, skeletons, imus = session
    return run(merged(skeletons, imus))


def rms_deg(estimates, t, dof):
    errors = [
        e.position[e.dof_names.index(name)] - truth_at(e, t, dof)[MODEL.dof_index[name]]
        for e in estimates
        if e.stamp_ns > START_NS + JUDGED_S * 1e9
        for name in ANGLES
    ]
    return np.degrees(np.sqrt(np.mean(np.square(errors))))


def test_nine_misaligned_imus_are_aligned_from_motion_without_an_n_pose(with_imus):
    pipeline, _ = with_imus
    uses = uses_of(pipeline)
    assert sorted(uses) == sorted(EVERY_SEGMENT)
    assert [use.segment for use in uses.values() if not use.is_aligned] == []
    assert all("used from" in str(use) for use in uses.values())


def test_aligned_imus_reduce_the_angle_errors(with_imus, session):
    t, dof, skeletons, _ = session
    _, alone = run(skeletons)
    assert rms_deg(with_imus[1], t, dof) < 0.6 * rms_deg(alone, t, dof)


def test_an_imu_without_motion_is_reported_with_a_remedy(session):
    _, _, skeletons, imus = session

    def lie(sample):
        if sample.segment != "right_thigh":
            return sample
        flat = np.array([0.6, 0.0, 0.0, 0.8])
        return replace(sample, orientation=flat, angular_velocity=np.zeros(3))

    pipeline, _ = run(merged(skeletons, [lie(s) for s in imus]))
    uses = uses_of(pipeline)
    assert [name for name, use in uses.items() if use.reason] == ["right_thigh"]
    assert uses["right_thigh"].reason.startswith("it has not turned by 8° yet")


@pytest.fixture(scope="module")
def exchanged(session):
    _, _, skeletons, imus = session
    wrong = [replace(s, segment=EXCHANGED.get(s.segment, s.segment)) for s in imus]
    return uses_of(run(merged(skeletons, wrong))[0])


def test_imus_on_exchanged_segments_are_used_as_worn_and_reported(exchanged):
    assert {
        n: use.exchanged_with for n, use in exchanged.items() if use.exchanged_with
    } == EXCHANGED
    assert {name for name, use in exchanged.items() if "exchanged" in str(use)} == set(EXCHANGED)
    assert all(use.is_aligned for use in exchanged.values())


def test_exchanged_imus_that_are_put_back_are_on_their_own_segments_again(session):
    _, _, skeletons, imus = session
    back_ns = START_NS + 19 * S
    until_back = [
        replace(s, segment=EXCHANGED.get(s.segment, s.segment)) if s.stamp_ns < back_ns else s
        for s in imus
    ]
    samples = merged(skeletons, until_back)
    pipeline, _ = run([s for s in samples if s.stamp_ns < back_ns])
    assert {
        n: use.exchanged_with for n, use in uses_of(pipeline).items() if use.exchanged_with
    } == EXCHANGED
    fused(pipeline, [s for s in samples if s.stamp_ns >= back_ns])
    uses = uses_of(pipeline)
    assert {name: use.exchanged_with for name, use in uses.items() if use.exchanged_with} == {}
    assert all(back_ns < uses[name].aligned_ns < back_ns + 4 * S for name in EXCHANGED)


@pytest.mark.parametrize("is_moved", [False, True])
def test_an_imu_is_used_again_soon_after_a_pause_also_if_it_was_strapped_on_anew(session, is_moved):
    _, _, skeletons, imus = session
    pause_ns = (START_NS + 16 * S, START_NS + 19 * S)
    moved = Rotation.from_rotvec([0.0, 0.9, 0.9]) if is_moved else Rotation.identity()

    def worn(sample):
        if sample.segment != "right_thigh" or sample.stamp_ns < pause_ns[0]:
            return sample
        orientation = (Rotation.from_quat(sample.orientation) * moved).as_quat()
        rate = moved.inv().apply(sample.angular_velocity)
        return replace(sample, orientation=orientation, angular_velocity=rate)

    heard = [
        worn(s)
        for s in imus
        if s.segment != "right_thigh" or not pause_ns[0] < s.stamp_ns < pause_ns[1]
    ]
    use = uses_of(run(merged(skeletons, heard))[0])["right_thigh"]
    assert use.is_aligned
    assert pause_ns[1] < use.aligned_ns < pause_ns[1] + (5 if is_moved else 2) * S
    assert use.contradictions == int(is_moved)


def test_an_imu_that_returns_after_a_second_with_another_heading_does_not_turn_the_limb(session):
    t, dof, skeletons, imus = session
    name, pause_ns = "right_forearm", (START_NS + 15 * S, START_NS + 16 * S)
    turn = Rotation.from_euler("z", 120.0, degrees=True)
    heard = [
        replace(s, orientation=(turn * Rotation.from_quat(s.orientation)).as_quat())
        if s.segment == name and s.stamp_ns >= pause_ns[1]
        else s
        for s in imus
        if s.segment != name or not pause_ns[0] < s.stamp_ns < pause_ns[1]
    ]
    pipeline, estimates = run(merged(skeletons, heard))
    _, by_cameras = run(skeletons)
    use = uses_of(pipeline)[name]
    assert use.aligned_ns > pause_ns[1]
    assert not use.contradictions  # the cameras need not contradict it first
    after = [[e for e in each if e.stamp_ns > pause_ns[0]] for each in (estimates, by_cameras)]
    assert rms_deg(after[0], t, dof) < 0.8 * rms_deg(after[1], t, dof)


def test_an_imu_of_an_unknown_segment_is_reported(session):
    _, _, skeletons, imus = session
    torso = [replace(s, segment="tail") for s in imus if s.segment == "torso"]
    pipeline, _ = run(merged(skeletons[:600], torso[:1000]))
    assert "tail: not used, the body model has no link" in str(uses_of(pipeline)["tail"])


def test_an_imu_without_a_usable_sample_at_any_frame_is_reported(session):
    _, _, skeletons, imus = session
    early = [replace(s, stamp_ns=s.stamp_ns - 60_000_000_000) for s in imus if s.segment == "torso"]
    pipeline, _ = run(merged(early[:10], skeletons[:600]))
    assert "no usable sample at any frame" in uses_of(pipeline)["torso"].reason


def test_imus_with_wrong_angular_velocities_are_used_and_reported(session):
    t, dof, skeletons, imus = session
    wrong = [replace(s, angular_velocity=np.degrees(s.angular_velocity)) for s in imus]
    pipeline, estimates = run(merged(skeletons, wrong))
    assert all(use.is_aligned and "degrees per second?" in str(use) for use in pipeline.imu_uses)
    _, by_cameras = run(skeletons)
    assert rms_deg(estimates, t, dof) < 0.8 * rms_deg(by_cameras, t, dof)


@pytest.mark.parametrize("estimator", ["mean", "dof_kf"])
def test_an_estimator_without_imus_reports_them_as_unused(session, estimator):
    _, _, skeletons, imus = session
    pipeline, _ = run(merged(skeletons[:400], imus[:1000]), estimator=estimator)
    assert all("uses no IMUs: use default" in use.reason for use in pipeline.imu_uses)
    assert len(pipeline.imu_uses) == len({s.segment for s in imus[:1000]})


def test_a_tracker_delay_of_60_ms_is_estimated_within_20_ms_after_26_s(session):
    _, _, skeletons, imus = session
    late = [replace(s, stamp_ns=s.stamp_ns + 60 * MS) for s in skeletons]
    pipeline, _ = run(merged(late, imus))
    delays = pipeline._runner.estimator._filter.delays_s
    np.testing.assert_allclose(delays, 0.06, atol=0.02)


def test_the_delay_of_undelayed_trackers_is_estimated_as_zero(with_imus):
    delays = with_imus[0].tracker_delays_s
    assert list(delays) == ["left", "right"]
    for delay_s, stddev_s in delays.values():
        assert abs(delay_s) < 2.0 * stddev_s < 0.03


def test_without_imus_a_delay_is_not_known(session):
    _, _, skeletons, _ = session
    pipeline, _ = run(skeletons[:600])
    assert all(stddev_s > 0.03 for _, stddev_s in pipeline.tracker_delays_s.values())


def test_coinciding_joints_do_not_disturb_the_alignment(session):
    """The knee is seen where the foot is."""
    _, _, skeletons, imus = session
    knee, foot = JOINT_INDEX["left_knee"], JOINT_INDEX["left_foot"]

    def collapsed(sample):
        if not 8.0 < (sample.stamp_ns - START_NS) * 1e-9 < 9.0:
            return sample
        positions = sample.positions.copy()
        positions[knee] = positions[foot]
        return replace(sample, positions=positions)

    shank = [s for s in imus if isinstance(s, ImuSample) and s.segment == "left_shank"]
    pipeline, estimates = run(merged([collapsed(s) for s in skeletons], shank))
    assert pipeline.imu_uses[0].is_aligned
    assert np.isfinite([e.position for e in estimates]).all()


def slipped(samples, segment, at_ns, rotvec, during_s):
    """The samples of an IMU whose strap slips, as its gyroscope measures, too."""
    found = []
    for sample in samples:
        if sample.segment == segment and sample.stamp_ns > at_ns:
            share = min((sample.stamp_ns - at_ns) * 1e-9 / during_s, 1.0)
            slip = Rotation.from_rotvec(share * np.array(rotvec))
            orientation = Rotation.from_quat(sample.orientation) * slip
            rate = slip.inv().apply(sample.angular_velocity)
            if share < 1.0:
                rate += np.array(rotvec) / during_s
            sample = replace(sample, orientation=orientation.as_quat(), angular_velocity=rate)
        found.append(sample)
    return found


@pytest.mark.parametrize(
    ("rotvec", "during_s"), [([0.0, 1.2, 0.0], 0.001), ([0.0, 0.52, 0.0], 0.3)]
)
def test_a_slipped_imu_does_not_keep_its_calibrated_alignment(session, rotvec, during_s):
    """The calibration was right until the strap slipped about the bone, at once or within 0.3 s."""
    _, _, skeletons, imus = session
    reference, _ = run(merged(skeletons, imus))
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    pipeline.use_sensor_to_segment(reference.sensor_to_segment)
    slip_ns = START_NS + round(14e9)
    fused(pipeline, merged(skeletons, slipped(imus, "left_shank", slip_ns, rotvec, during_s)))
    contradictions = {name: use.contradictions for name, use in uses_of(pipeline).items()}
    assert contradictions.pop("left_shank") == 1
    assert not any(contradictions.values())
    assert uses_of(pipeline)["left_shank"].is_aligned
    before, after = (
        Rotation.from_matrix(each.sensor_to_segment["left_shank"].R_sensor_segment)
        for each in (reference, pipeline)
    )
    angle = np.degrees((before.inv() * after).magnitude())
    assert angle == pytest.approx(np.degrees(np.linalg.norm(rotvec)), abs=15.0)


def test_a_slip_that_is_known_in_advance_costs_only_its_own_time(session):
    """As of a recording that is read for the second time."""
    _, _, skeletons, imus = session
    reference, _ = run(merged(skeletons, imus))
    before = reference.sensor_to_segment["left_shank"]
    rotvec = np.array([0.0, 0.52, 0.0])
    turned = Rotation.from_rotvec(-rotvec).as_matrix() @ before.R_sensor_segment
    slip_ns = START_NS + round(14e9)
    slip = Slip(
        begin_ns=slip_ns - 1000 * MS,
        end_ns=slip_ns + 1000 * MS,
        after=replace(before, R_sensor_segment=turned),
    )
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    pipeline.use_sensor_to_segment({"left_shank": replace(before, slip=slip)})
    samples = merged(skeletons, slipped(imus, "left_shank", slip_ns, rotvec, 0.3))
    used = {}
    for each in blocks_between_frames(samples):
        pipeline.add(each)
        if isinstance(each, SkeletonSample):
            half = (each.stamp_ns - slip_ns) // (500 * MS)
            used[half] = "left_shank" in pipeline.sensor_to_segment
    assert not any(used[half] for half in range(-1, 2))
    assert all(is_used for half, is_used in used.items() if half > 6)
    assert uses_of(pipeline)["left_shank"].contradictions == 1
    found = pipeline.sensor_to_segment["left_shank"].R_sensor_segment
    assert Rotation.from_matrix(turned.T @ found).magnitude() < np.radians(6.0)


def test_a_calibrated_alignment_of_another_time_is_replaced(session):
    """The IMU has been strapped on anew since the calibration."""
    _, _, skeletons, imus = session
    reference, _ = run(merged(skeletons, imus))
    true = reference.sensor_to_segment["left_shank"]
    turned = true.R_sensor_segment @ Rotation.from_rotvec([1.2, 0.0, 0.0]).as_matrix()
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    pipeline.use_sensor_to_segment({"left_shank": replace(true, R_sensor_segment=turned)})
    fused(pipeline, merged(skeletons, imus))
    assert uses_of(pipeline)["left_shank"].contradictions >= 1
    found = pipeline.sensor_to_segment["left_shank"].R_sensor_segment
    assert Rotation.from_matrix(true.R_sensor_segment.T @ found).magnitude() < np.radians(10.0)


def test_imus_that_exchange_their_names_are_rejected_at_once(session):
    """And what a calibration knows of them counts no more."""
    _, _, skeletons, imus = session
    change_ns = START_NS + round(15e9)
    exchanged = [replace(s, segment=EXCHANGED.get(s.segment, s.segment)) for s in imus]
    before = [s for s in merged(skeletons, imus) if s.stamp_ns < change_ns]
    after = [s for s in merged(skeletons, exchanged) if s.stamp_ns >= change_ns]
    reference, _ = run(before)
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    pipeline.use_sensor_to_segment(reference.sensor_to_segment)
    fused(pipeline, before + [s for s in after if s.stamp_ns < change_ns + 100 * MS])
    uses = uses_of(pipeline)
    assert {name for name, use in uses.items() if use.contradictions} == set(EXCHANGED)
    assert {name for name, use in uses.items() if not use.is_aligned} == set(EXCHANGED)
    fused(pipeline, [s for s in after if 100 * MS <= s.stamp_ns - change_ns < 1100 * MS])
    uses = uses_of(pipeline)
    assert {name for name, use in uses.items() if not use.is_aligned} == set(EXCHANGED)


def in_an_uneven_field(samples):
    """The samples with headings that swing by 12°, each in its own time."""
    swung = []
    for sample in samples:
        since_s = (sample.stamp_ns - START_NS) * 1e-9
        phase = EVERY_SEGMENT.index(sample.segment)
        turn = Rotation.from_euler("z", 12.0 * np.sin(0.7 * since_s + phase), degrees=True)
        turned = turn * Rotation.from_quat(sample.orientation)
        swung.append(replace(sample, orientation=turned.as_quat()))
    return swung


def test_uneven_magnetic_fields_are_named_and_cost_half_a_degree_at_most(session, with_imus):
    t, dof, skeletons, imus = session
    pipeline, estimates = run(merged(skeletons, in_an_uneven_field(imus)))
    for use in pipeline.imu_uses:
        assert not use.reason
        assert "magnetic field" in use.remark
    assert not any("magnetic" in use.remark for use in with_imus[0].imu_uses)
    assert rms_deg(estimates, t, dof) < rms_deg(with_imus[1], t, dof) + 0.5
