from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from synthetic_body import FRAME_NS, MODEL, extrinsics, kinematics, motion, skeleton_samples
from worn_imus import START_NS, imu_samples, merged, truth_at

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.joints import JOINT_INDEX, TrackingState
from pose_core.kernels.published_state import Source

LI2020 = PipelineParameters(estimator="li2020")


def run(samples, parameters=None, placed=None):
    pipeline = Pipeline(parameters or LI2020, placed or extrinsics())
    return pipeline, fused(pipeline, samples)


def session(duration_s=10.0, noise=0.01, seed=21, lean=0.0):
    t, dof = motion(duration_s, lean=lean)
    positions = kinematics().pose(dof).positions
    samples = skeleton_samples(positions, extrinsics(), np.random.default_rng(seed), noise)
    return t, dof, samples


def angle_rms(estimates, t, dof, name):
    index = MODEL.dof_index[name]
    errors = [e.position[index] - truth_at(e, t, dof)[index] for e in estimates]
    return np.degrees(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module")
def plain():
    t, dof, samples = session()
    return t, dof, samples, *run(samples)


def test_every_aligned_frame_after_the_body_calibration_gives_an_estimate(plain):
    _, _, _, pipeline, estimates = plain
    counts = pipeline.counters
    assert counts["frames_measuring_the_body"] == pytest.approx(61, abs=3)
    assert counts["estimates"] == counts["frames"] - counts["frames_measuring_the_body"]
    assert len(estimates) == counts["estimates"]
    assert np.all(np.diff([e.stamp_ns for e in estimates]) > 0)


def test_knee_flexion_agrees_with_the_truth(plain):
    t, dof, _, _, estimates = plain
    assert angle_rms(estimates, t, dof, "left_knee_flexion") < 8.0
    assert angle_rms(estimates, t, dof, "right_hip_flexion") < 8.0


def test_the_outlet_receives_the_estimates_otherwise_returned(plain):
    _, _, samples, _, estimates = plain
    pipeline = Pipeline(LI2020, extrinsics())
    blocks = []
    pipeline.outlet = blocks.append
    assert fused(pipeline, samples) == []
    given = [estimate for block in blocks for estimate in block]
    for one, other in zip(estimates, given, strict=True):
        assert one.stamp_ns == other.stamp_ns
        np.testing.assert_array_equal(one.T_map_link, other.T_map_link)


def test_two_runs_give_identical_estimates(plain):
    _, _, samples, _, estimates = plain
    _, again = run(samples)
    for one, other in zip(estimates, again, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.position_stddev, other.position_stddev)


def test_estimates_are_independent_of_the_interleaving_of_streams():
    t, dof, skeletons = session(6.0)
    samples = merged(skeletons, imu_samples(t, dof, np.random.default_rng(1)))
    rng = np.random.default_rng(2)
    late = [s.stamp_ns + int(rng.uniform(0, 8e6)) for s in samples]
    by_stream = {}
    for sample, arrival in zip(samples, late, strict=True):
        stream = getattr(sample, "sensor", None) or sample.segment
        by_stream[stream] = max(arrival, by_stream.get(stream, 0) + 1)
        late[samples.index(sample)] = by_stream[stream]
    shuffled = [s for _, s in sorted(zip(late, samples, strict=True), key=lambda pair: pair[0])]
    _, one = run(samples)
    _, other = run(shuffled)
    assert [e.stamp_ns for e in one] == [e.stamp_ns for e in other]
    np.testing.assert_array_equal(one[-1].position, other[-1].position)


def test_without_extrinsics_samples_are_counted_and_nothing_is_published(plain):
    _, _, samples, _, _ = plain
    pipeline = Pipeline(LI2020)
    assert [e for sample in samples[:50] for e in pipeline.add(sample)] == []
    assert pipeline.counters["skeletons_before_extrinsics"] == 50
    assert pipeline.status == "waiting for extrinsics"


def test_samples_before_the_extrinsics_measure_the_body_but_give_no_estimates():
    t, dof, skeletons = session(12.0)
    samples = merged(skeletons, imu_samples(t, dof, np.random.default_rng(6)))
    pipeline = Pipeline(LI2020)
    placed_ns = START_NS + 8 * 10**9
    estimates = []
    for sample in samples:
        if pipeline.extrinsics is None and sample.stamp_ns > placed_ns:
            pipeline.use_extrinsics(extrinsics())
        estimates += pipeline.add(sample)
    assert estimates[0].stamp_ns > placed_ns - 2 * FRAME_NS
    assert estimates[0].stamp_ns < placed_ns + 4 * FRAME_NS


def test_samples_waiting_for_extrinsics_are_bounded():
    _, _, samples = session(3.0)
    pipeline = Pipeline(LI2020)
    for shift_s in range(0, 200, 3):
        for sample in samples[::10]:
            pipeline.add(replace(sample, stamp_ns=sample.stamp_ns + shift_s * 10**9))
    assert len(pipeline._preprocessor._waiting) < 200


def test_estimation_continues_with_the_remaining_sensor():
    _, _, samples = session(8.0)
    cut = START_NS + 5 * 10**9
    samples = [s for s in samples if s.sensor == "left" or s.stamp_ns < cut]
    _, estimates = run(samples)
    after = [e for e in estimates if e.stamp_ns > cut + 300_000_000]
    assert len(after) > 60
    assert np.all(after[-1].source == Source.KINECT)


@pytest.mark.parametrize("estimator", ["li2020", "default"])
def test_samples_of_a_sensor_without_extrinsics_are_counted_and_not_used(estimator):
    _, _, samples = session(4.0)
    both = extrinsics()
    left = replace(both, T_reference_sensor={"left": both.T_reference_sensor["left"]})
    pipeline, estimates = run(samples, PipelineParameters(estimator=estimator), left)
    right = sum(sample.sensor == "right" for sample in samples)
    assert pipeline.counters["skeletons_of_unknown_sensors"] == right
    assert len(estimates) > 30
    assert np.isfinite([estimate.position for estimate in estimates]).all()


def test_the_source_of_an_untracked_joint_is_predicted():
    _, _, samples = session(5.0)
    knee = JOINT_INDEX["left_foot"]
    state = samples[0].tracking_state.copy()
    state[knee] = TrackingState.NOT_TRACKED
    blind = []
    for sample in samples:
        positions = sample.positions.copy()
        positions[knee] = np.nan
        hidden = replace(sample, positions=positions, tracking_state=state)
        blind.append(hidden if sample.stamp_ns > START_NS + 4 * 10**9 else sample)
    _, estimates = run(blind)
    flexion = MODEL.dof_index["left_knee_flexion"]
    assert estimates[-1].source[flexion] == Source.PREDICTED
    assert estimates[-1].weight_kinect[flexion] == 0.0
    assert estimates[-1].position_stddev[flexion] > estimates[0].position_stddev[flexion]
    assert estimates[-1].tracking_state[knee] == TrackingState.NOT_TRACKED


def test_the_filter_restarts_at_the_persons_position_after_a_long_gap():
    _, _, samples = session(8.0)
    gap = (START_NS + 4 * 10**9, START_NS + 6 * 10**9)
    pipeline, estimates = run([s for s in samples if not gap[0] < s.stamp_ns < gap[1]])
    assert pipeline.counters["filter_restarts_gap"] == 1
    assert estimates[-1].stamp_ns > gap[1] + 10**9


def test_estimation_continues_after_a_recording_loops():
    _, _, samples = session(4.0)
    pipeline, estimates = run(samples + samples)
    assert pipeline.aligner.counters["clock_jumped_back"] >= 1
    half = len(estimates) // 2
    assert estimates[-1].stamp_ns == pytest.approx(samples[-1].stamp_ns, abs=3 * FRAME_NS)
    assert estimates[half + 40].stamp_ns < estimates[half - 40].stamp_ns


def test_frames_of_nan_do_not_stop_the_pipeline():
    _, _, samples = session(5.0)
    rng = np.random.default_rng(3)
    holes = []
    for sample in samples:
        positions = sample.positions.copy()
        positions[rng.random(15) < 0.3] = np.nan
        holes.append(replace(sample, positions=positions))
    _, estimates = run(holes)
    assert len(estimates) > 50
    assert all(np.all(np.isfinite(e.position)) for e in estimates)


def test_joint_angles_have_no_steps_between_estimates(plain):
    _, _, _, _, estimates = plain
    positions = np.array([e.position for e in estimates])
    assert np.max(np.abs(np.diff(positions[:, 3:], axis=0))) < np.radians(60.0)
