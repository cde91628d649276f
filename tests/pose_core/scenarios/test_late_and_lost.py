"""IMUs and cameras that come late, in bursts, out of order or not at all (synthetic)."""

from dataclasses import replace

import numpy as np
import pytest
from fusing import fused
from scipy.spatial.transform import Rotation
from synthetic_body import MODEL, extrinsics
from worn_imus import IMU_SEGMENTS, START_NS, moving_wearer

from pose_core.estimators.parameters import PipelineParameters
from pose_core.fusion.pipeline import Pipeline
from pose_core.kernels.published_state import Source
from pose_core.streams.samples import ImuSample, SkeletonSample

DURATION_S = 26.0
JUDGED_S = 20.0  # from then on, the IMUs are aligned
DISTURBED_S = (21.5, 23.5)
MS = 1_000_000
STEP_DEG = 15.0  # beyond the true motion, from one estimate to the next, of each frame
ERROR_DEG = 25.0
ANGLES = ("left_knee_flexion", "left_hip_flexion", "left_elbow_flexion", "left_shoulder_flexion")


@pytest.fixture(scope="module")
def session():
    return moving_wearer(DURATION_S)


def is_disturbed(sample):
    return DISTURBED_S[0] < (sample.stamp_ns - START_NS) * 1e-9 < DISTURBED_S[1]


def is_camera(sample):
    return isinstance(sample, SkeletonSample)


def arriving(samples, delay_ns):
    """The samples in the order in which they arrive; a delay of None loses one."""
    timed = [(delay_ns(s), s) for s in samples]
    kept = [(s.stamp_ns + delay, s) for delay, s in timed if delay is not None]
    return [s for _, s in sorted(kept, key=lambda pair: pair[0])]


def run(samples, **parameters):
    parameters = PipelineParameters(output_rate=0.0, **parameters)  # each frame's estimate
    pipeline = Pipeline(parameters, extrinsics())
    return pipeline, fused(pipeline, samples)


def aligned(pipeline):
    return [use.segment for use in pipeline.imu_uses if use.is_aligned]


def differences_deg(estimates, t, dof):
    """From the truth, shape (n, angles) [deg], of what is judged."""
    late = [e for e in estimates if e.stamp_ns > START_NS + JUDGED_S * 1e9]
    times = np.array([(e.stamp_ns - START_NS) * 1e-9 for e in late])
    assert len(late) > 50
    columns = [
        np.array([e.position[e.dof_names.index(name)] for e in late])
        - np.interp(times, t, dof[:, MODEL.dof_index[name]])
        for name in ANGLES
    ]
    return np.degrees(np.stack(columns, axis=1))


def bursts(period_ns):
    return lambda sample: -sample.stamp_ns % period_ns


CASES = {
    "imus 50 ms late": lambda s: 0 if is_camera(s) else 50 * MS,
    "imus 500 ms late for a while": lambda s: 500 * MS * (not is_camera(s) and is_disturbed(s)),
    "imus in bursts": lambda s: 0 if is_camera(s) else bursts(300 * MS)(s),
    "imus lost for a while": lambda s: None if not is_camera(s) and is_disturbed(s) else 0,
    "cameras 150 ms late": lambda s: 150 * MS * is_camera(s),
    "cameras 400 ms late": lambda s: 400 * MS * is_camera(s),
    "cameras lost for a while": lambda s: None if is_camera(s) and is_disturbed(s) else 0,
    "one camera 500 ms late": lambda s: 500 * MS * (is_camera(s) and s.sensor == "right"),
}


@pytest.mark.parametrize("case", CASES)
def test_late_and_lost_samples_cause_no_step(case, session):
    t, dof, skeletons, imus = session
    _, estimates = run(arriving([*skeletons, *imus], CASES[case]))
    difference = differences_deg(estimates, t, dof)
    assert np.abs(np.diff(difference, axis=0)).max() < STEP_DEG
    assert np.abs(difference).max() < ERROR_DEG


def test_imus_are_aligned_by_cameras_with_a_delay(session):
    t, dof, skeletons, imus = session
    samples = arriving([*skeletons, *imus], CASES["cameras 400 ms late"])
    pipeline, estimates = run(samples, estimator="imu")
    assert aligned(pipeline) == sorted(IMU_SEGMENTS)
    assert np.abs(differences_deg(estimates, t, dof)).mean() < 8.0


def test_imus_alone_give_no_pose_before_the_cameras_are_unused(session):
    """One IMU never moves: it is waited for 10 s after the first other one is aligned."""
    *_, skeletons, imus = session
    still = next(s for s in imus if s.segment == "left_shank")
    imus = [replace(still, stamp_ns=s.stamp_ns) if s.segment == "left_shank" else s for s in imus]
    pipeline, estimates = run(arriving([*skeletons, *imus], lambda _: 0), estimator="imu")
    assert not any(np.any(estimate.source & Source.KINECT) for estimate in estimates)
    first_ns = min(use.aligned_ns for use in pipeline.imu_uses if use.is_aligned)
    assert (estimates[0].stamp_ns - first_ns) * 1e-9 == pytest.approx(10.0, abs=0.1)


def test_the_deviation_grows_while_the_only_imus_are_lost(session):
    *_, skeletons, imus = session
    samples = arriving([*skeletons, *imus], CASES["imus lost for a while"])
    pipeline, estimates = run(samples, estimator="imu")
    knee = MODEL.dof_index["left_knee_flexion"]
    times = np.array([(e.stamp_ns - START_NS) * 1e-9 for e in estimates])
    stddev = np.array([e.position_stddev[knee] for e in estimates])
    before = stddev[(times > JUDGED_S) & (times < DISTURBED_S[0])].max()
    lost = stddev[(times > DISTURBED_S[0] + 0.5) & (times < DISTURBED_S[1])]
    assert lost.min() > 2.0 * before
    assert pipeline.imus.counters["imu_gaps"] == len(IMU_SEGMENTS)
    assert pipeline.imus.counters["imu_readings_missing"] > 100


@pytest.mark.parametrize("estimator", ["default", "imu"])
def test_an_imu_that_restarts_with_another_heading_is_rejected(estimator, session):
    """After half a second without samples its world has turned by a right angle."""
    t, dof, skeletons, imus = session
    turn = Rotation.from_euler("z", np.pi / 2.0)
    heading_free = np.array([0.02, 0.02, np.pi])
    begins_ns = START_NS + 22_000 * MS

    def changed(sample):
        sample = replace(sample, orientation_stddev=heading_free)
        if sample.stamp_ns < begins_ns:
            return sample
        turned = (turn * Rotation.from_quat(sample.orientation)).as_quat()
        return replace(sample, orientation=turned)

    kept = [changed(s) for s in imus if not begins_ns - 500 * MS < s.stamp_ns < begins_ns]
    pipeline, estimates = run(arriving([*skeletons, *kept], lambda _: 0), estimator=estimator)
    difference = differences_deg(estimates, t, dof)
    assert pipeline.imus.counters["imu_gaps"] == len(IMU_SEGMENTS)
    step_deg = STEP_DEG if estimator == "default" else 17.0
    periods_ns = np.diff([e.stamp_ns for e in estimates[-len(difference) :]])
    is_next = periods_ns < 100 * MS  # imu has no pose while the cameras align its IMUs again
    assert is_next.all() == (estimator == "default")
    assert np.abs(np.diff(difference, axis=0))[is_next].max() < step_deg
    if estimator == "default":
        assert np.abs(difference).max() < ERROR_DEG


def test_simultaneous_heading_steps_of_all_imus_are_compensated(session):
    _, _, skeletons, imus = session
    turn = Rotation.from_euler("z", np.radians(60.0))

    def leapt(sample):
        turned = (turn * Rotation.from_quat(sample.orientation)).as_quat()
        return replace(sample, orientation=turned) if is_disturbed(sample) else sample

    plain, as_it_is = run(arriving([*skeletons, *imus], lambda _: 0))
    pipeline, estimates = run(arriving([*skeletons, *map(leapt, imus)], lambda _: 0))
    pairs = zip(estimates, as_it_is, strict=True)
    assert max(np.abs(np.degrees(a.position - b.position)[6:]).max() for a, b in pairs) < 5.0
    assert aligned(pipeline) == aligned(plain) == sorted(IMU_SEGMENTS)


def test_a_new_pipeline_uses_the_alignment_of_the_previous_one(session):
    *_, skeletons, imus = session
    samples = arriving([*skeletons, *imus], lambda _: 0)
    until = [sum(s.stamp_ns < START_NS + end_s * 1e9 for s in samples) for end_s in (20.0, 21.5)]
    before, _ = run(samples[: until[0]])
    found = before.sensor_to_segment
    assert sorted(found) == sorted(IMU_SEGMENTS)

    parameters = PipelineParameters(output_rate=0.0)
    after = Pipeline(parameters, extrinsics())
    after.use_shape(before.shape)
    after.use_sensor_to_segment(found)
    fused(after, samples[until[0] : until[1]])
    assert aligned(after) == sorted(IMU_SEGMENTS)


def test_imu_samples_without_an_orientation_are_counted_and_left_out(session):
    *_, skeletons, imus = session
    nan = np.full(4, np.nan)
    lost = [replace(s, orientation=nan) if i % 7 == 0 else s for i, s in enumerate(imus)]
    until_ns = START_NS + int(20e9)
    samples = [s for s in arriving([*skeletons, *lost], lambda _: 0) if s.stamp_ns < until_ns]
    pipeline, _ = run(samples)
    expected = sum(isinstance(s, ImuSample) and bool(np.isnan(s.orientation[0])) for s in samples)
    assert pipeline.counters["imu_samples_without_orientation"] == expected > 100
    assert aligned(pipeline) == sorted(IMU_SEGMENTS)


def test_samples_out_of_order_are_counted_and_cause_no_step(session):
    t, dof, skeletons, imus = session
    rng = np.random.default_rng(3)
    delays = {id(s): int(rng.integers(0, 100 * MS)) for s in imus}
    samples = arriving([*skeletons, *imus], lambda s: delays.get(id(s), 0))
    pipeline, estimates = run(samples)
    difference = differences_deg(estimates, t, dof)
    assert pipeline.counters["imu_samples_out_of_order"] > 100
    assert np.abs(np.diff(difference, axis=0)).max() < STEP_DEG
    assert np.abs(difference).max() < ERROR_DEG


@pytest.mark.parametrize(
    "parameters", [{"use_imus": False}, {"estimator": "joint_kf"}], ids=["default", "joint_kf"]
)
def test_unused_imus_do_not_keep_the_output_alive(parameters, session):
    *_, skeletons, imus = session
    seen = [s for s in skeletons if not is_disturbed(s)]
    alone = fused(Pipeline(PipelineParameters(**parameters), extrinsics()), seen)
    samples = arriving([*seen, *imus], lambda _: 0)
    pipeline = Pipeline(PipelineParameters(**parameters), extrinsics())
    estimates = fused(pipeline, samples)
    assert [e.stamp_ns for e in estimates] == [e.stamp_ns for e in alone]
    np.testing.assert_array_equal(
        [e.position for e in estimates], [e.position for e in alone], strict=True
    )
    assert sorted(use.segment for use in pipeline.imu_uses) == sorted(IMU_SEGMENTS)


@pytest.mark.parametrize("worn", [("left_forearm",), IMU_SEGMENTS], ids=["one", "nine"])
def test_without_cameras_few_imus_do_not_keep_a_guessed_pose_alive(worn, session):
    *_, skeletons, imus = session
    samples = [
        *(s for s in skeletons if not is_disturbed(s)),
        *(s for s in imus if s.segment in worn),
    ]
    pipeline = Pipeline(PipelineParameters(), extrinsics())
    estimates = fused(pipeline, arriving(samples, lambda _: 0))
    assert set(aligned(pipeline)) == set(worn)
    stamps_s = np.array([e.stamp_ns - START_NS for e in estimates]) / 1e9
    longest_s = np.diff(stamps_s).max()
    silence_s = DISTURBED_S[1] - DISTURBED_S[0] - PipelineParameters().forget_after
    assert longest_s == pytest.approx(silence_s if len(worn) == 1 else 0.01, abs=0.05)


@pytest.mark.parametrize(
    ("is_heard", "text"),
    [
        (lambda time: time < 15.0, "; without usable samples from 15.0 s on"),
        (lambda time: time > 12.0, "; without usable samples from 0.0 to 12.0 s"),
        (lambda time: not 9.0 < time < 11.0, "; without usable samples from 9.0 to 11.0 s"),
        (
            lambda time: time % 3.0 < 1.5,
            "; without usable samples 8 times, the last from 22.5 to 24.0 s",
        ),
        (lambda time: not 9.0 < time < 9.5, "; without usable samples from 9.0 to 9.5 s"),
        (lambda time: not 9.0 < time < 9.2, ""),
    ],
    ids=["end", "start", "middle", "often", "short", "hardly"],
)
def test_an_imu_that_falls_silent_is_named(is_heard, text, session):
    *_, skeletons, imus = session
    heard = [
        s for s in imus if s.segment != "left_shank" or is_heard((s.stamp_ns - START_NS) * 1e-9)
    ]
    pipeline, _ = run(arriving([*skeletons, *heard], lambda _: 0))
    uses = {use.segment: use for use in pipeline.imu_uses}
    assert str(uses["left_shank"]).partition("; without")[1:] == text.partition("; without")[1:]
    assert not any("without" in str(use) for name, use in uses.items() if name != "left_shank")
    assert uses["left_shank"].frames == uses["torso"].frames
