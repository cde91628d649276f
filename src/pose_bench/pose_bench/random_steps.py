"""Random steps of the default filter: its covariance stays symmetric and positive definite.

A step predicts over a random time, then updates with the samples of a random part of the IMUs and
with random joints of a random camera, some of them anywhere. Occasionally the person is elsewhere,
an IMU is realigned, or an IMU's sample is unrelated to the motion.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_bench.speed import Scene, aligned_filter, camera_place
from pose_core.arrays import FloatArray
from pose_core.body.model import load_body_model
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuFrame
from pose_core.filter.motion import predict
from pose_core.filter.state import FilterState, with_imu, with_shared_offset
from pose_core.filter.step import update_with_frame, update_with_imus
from pose_core.joints import JOINT_INDEX, JOINTS, LIMB_ENDS

CAMERAS, IMUS = 2, 9
MIN_DURATION_S, MAX_DURATION_S = 1e-6, 1.0  # [s] of a step; log-uniform
FRAMES = 3000  # of the motion, which is repeated
MOVES, REALIGNED, UNRELATED = 0.002, 0.001, 0.01  # [-] probability for each step
OUTLIERS = 0.1  # [-] of the visible joints, in one frame of four
OUTLIER_M = 1.0  # [m]
FAR_JOINTS = [JOINT_INDEX[far] for _, far in LIMB_ENDS.values()]
CHECKED = 10  # [steps] between factorisations of P
SHOWN = 10_000  # [steps] between results


@dataclass(kw_only=True)
class Checks:
    """Results of the steps so far."""

    steps: int = 0
    asymmetry: float = 0.0  # [-] largest difference of the correlation matrix from its transpose
    factorised: int = 0  # Cholesky factorisations of P
    indefinite: int = 0  # of these, failed ones
    infinite: int = 0  # updates that the filter refused as not finite
    least: float = np.inf  # [-] smallest eigenvalue of the correlation matrix of P


def random_steps(count: int, seed: int) -> Iterator[Checks]:
    """Run steps; yields the results so far after every :data:`SHOWN` steps, and at the end."""
    rng = np.random.default_rng(seed)
    scene = Scene(load_body_model("default"), FRAMES)
    constants, state = aligned_filter(scene, CAMERAS, IMUS)
    fresh = state.copy()
    information = np.zeros((2, len(state.imus.heading), 3, 3))
    checks, now = Checks(), 0
    for step in range(count):
        now = int(rng.integers(FRAMES)) if rng.random() < MOVES else (now + 1) % FRAMES
        dt_s = np.exp(rng.uniform(np.log(MIN_DURATION_S), np.log(MAX_DURATION_S)))
        if rng.random() < REALIGNED:
            state = _realigned(state, rng)
        predict(constants.motion, state, dt_s)
        imus = _imu_frame(scene, now, rng)
        is_finite = update_with_imus(constants, state, imus, information[1])
        frame = _frame(scene.joints[now], rng)
        if is_finite and rng.random() < 0.7:
            is_finite, *_ = update_with_frame(constants, state, frame, information[0])
        checks.steps += 1
        if not is_finite:
            checks.infinite += 1
            state = fresh.copy()
        _check(checks, state.P, step)
        if checks.steps % SHOWN == 0 or checks.steps == count:
            yield checks


def _imu_frame(scene: Scene, now: int, rng: np.random.Generator) -> ImuFrame:
    """Samples of a random part of the IMUs, in three of four steps."""
    is_on = (rng.random(IMUS) < rng.random()) & (rng.random() < 0.75)
    links = np.flatnonzero(is_on)
    noise = Rotation.from_rotvec(rng.normal(0.0, 0.05, (len(links), 3))).as_matrix()
    R = noise @ scene.rotations[now, links]
    if len(links) and rng.random() < UNRELATED:
        R[0] = Rotation.random(random_state=rng).as_matrix()
    return ImuFrame(
        links=links,
        R_world_sensor=np.ascontiguousarray(R),
        angular_velocity=scene.rates[now, links] + rng.normal(0.0, 0.2, (len(links), 3)),
        age_s=rng.choice([0.0, 0.02], len(links)),
        rate_stddev=rng.choice([0.0, 0.2], len(links)),
    )


def _frame(joints: FloatArray, rng: np.random.Generator) -> CameraFrame:
    """A frame of a random camera with random joints."""
    positions = joints + rng.normal(0.0, 0.03, joints.shape)
    is_seen = rng.random(len(JOINTS)) < rng.random()
    if rng.random() < 0.25:
        is_out = rng.random(len(JOINTS)) < OUTLIERS
        positions[is_out] += rng.normal(0.0, OUTLIER_M, (int(is_out.sum()), 3))
    states = rng.choice([1, 2], len(JOINTS), p=[0.2, 0.8]).astype(np.uint8)
    positions[~is_seen], states[~is_seen] = np.nan, 0
    sensor = int(rng.integers(CAMERAS))
    return CameraFrame(sensor, positions, states, camera_place(sensor))


def _realigned(state: FilterState, rng: np.random.Generator) -> FilterState:
    """The state with one IMU realigned, within 0.2 rad."""
    link = int(rng.integers(IMUS))
    R_sensor_link = Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)).as_matrix()
    covariance = np.diag([0.1, 0.1, 0.2, 0.1]) ** 2
    state = with_imu(state, link, R_sensor_link, float(rng.normal(0.0, 0.1)), covariance)
    return with_shared_offset(state, int(rng.choice(FAR_JOINTS)), 0.01**2)


def _check(checks: Checks, P: FloatArray, step: int) -> None:
    if step % CHECKED:
        return
    stddev = np.sqrt(np.diagonal(P))
    scale = np.outer(stddev, stddev)
    checks.asymmetry = max(checks.asymmetry, float((np.abs(P - P.T) / scale).max()))
    checks.factorised += 1
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        checks.indefinite += 1
    if step % (100 * CHECKED) == 0:
        checks.least = min(checks.least, float(np.linalg.eigvalsh(P / scale)[0]))
