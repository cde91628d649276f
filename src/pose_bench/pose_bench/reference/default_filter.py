r"""Reference implementation of the default filter in plain numpy.

The compiled filter must give the same results up to rounding errors.

Written from the equations that ``pose_core.filter`` documents, with full matrices:
:math:`P \leftarrow F P F^T + Q`, Joseph's form of the update, no shortcut by zeros.
"""

from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from pose_bench.reference.default_measurements import (
    FEET,
    Group,
    PlainView,
    camera_groups,
    columns,
    flexion,
    hinges,
    imu_groups,
    link_columns,
    posture_groups,
    standing_foot_groups,
    view_of,
)
from pose_bench.reference.default_tracker_errors import update_tracker_errors
from pose_core.arrays import FloatArray
from pose_core.filter.constants import FilterConstants
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuFrame
from pose_core.filter.posture import OPPOSITE
from pose_core.filter.state import FilterState, LinkImus
from pose_core.filter.step import StepResult
from pose_core.filter.update import UpdateConstants
from pose_core.joints import JOINTS

MAX_STDDEV = 1.2  # [rad]
CAMERA_TIMEOUT_S = 0.15  # [s]
FOOT_HEIGHT_S, DEPTH_MEMORY_S = 2.0, 1.0  # [s]
WAIST_MEMORY_S, WAIST_MOTION, WAIST_DOF = 60.0, 0.02, 4.0  # [s], [rad² s], [-]
MEAN_NIS_CLIP, LOST_NIS = 9.0, 25.0  # [-]


class ReferenceFilter:
    """The three parts of a filter step, on its own state.

    Args:
        constants: Constants of the filter.
        state: Initial state; copied.
    """

    def __init__(self, constants: FilterConstants, state: FilterState) -> None:
        self.constants, self.state = constants, state.copy()

    def predict(self, dt_s: float) -> None:
        """Advance by ``dt_s`` [s]."""
        motion, state = self.constants.motion, self.state
        keep, keep_slide, keep_offset = np.exp(
            -dt_s / np.array([motion.rate_memory_s, motion.slide_memory_s, motion.offset_memory_s])
        )
        rate_time_s = motion.rate_memory_s * (1.0 - keep)
        Q = self._process_noise(dt_s, keep_slide)
        slides, velocity = columns(state)
        F = np.eye(len(state.P))
        F[:slides, velocity : velocity + slides] = rate_time_s * np.eye(slides)
        F[slides:velocity, slides:velocity] *= keep_slide
        F[velocity : velocity + slides, velocity : velocity + slides] *= keep
        P = F @ state.P @ F.T + Q
        scale = np.ones(len(P))
        scale[3:slides] = np.minimum(1.0, MAX_STDDEV / np.sqrt(np.diag(P)[3:slides]))
        state.P[:] = np.outer(scale, scale) * P
        self._predict_headings(dt_s)
        error = np.zeros(len(P))
        error[:3] = rate_time_s * state.pose.velocity
        error[3:slides] = rate_time_s * state.pose.rates.ravel()
        inject_error(state, error)
        state.pose.velocity[:] *= keep
        state.pose.rates[:] *= keep
        state.pose.slides[:] *= keep_slide
        state.views.offset[:] *= keep_offset
        renewed = (1.0 - keep_offset**2) * motion.offset_variance
        state.views.offset_variance[:] = keep_offset**2 * state.views.offset_variance + renewed
        kept = np.exp(-dt_s / DEPTH_MEMORY_S)
        state.views.depth_error[:] *= kept
        renewed = (1.0 - kept**2) * state.views.depth_error_power
        state.views.depth_error_variance[:] = kept**2 * state.views.depth_error_variance + renewed
        state.views.silent_s[:] += dt_s

    def update_with_imus(self, imus: ImuFrame) -> FloatArray:
        """Update with aligned IMUs; returns each link's information, (links, 3, 3) [1/rad²]."""
        information = np.zeros((len(self.state.imus.heading), 3, 3))
        self.state.imus.is_used[:] = np.isin(np.arange(len(information)), imus.links)
        if len(imus.links) == 0:
            return information
        groups = list(imu_groups(self.constants.imu, self.state, imus))
        is_unseen = min(self.state.views.silent_s) > CAMERA_TIMEOUT_S
        if is_unseen:
            groups += posture_groups(self.constants, self.state)
        robust_update(self.state, groups, self.constants.imu_update)
        if is_unseen:
            feet = list(standing_foot_groups(self.constants.camera.body, self.state))
            if feet:
                robust_update(self.state, feet, self.constants.imu_update)
        for group in groups[: 2 * len(imus.links) : 2]:
            information[group.source] += group.weight * np.linalg.inv(group.noise)
        return information

    def update_with_frame(self, frame: CameraFrame) -> tuple[StepResult, FloatArray]:
        """Update with a camera's frame and the posture prior; returns the frame's information."""
        state, camera = self.state, self.constants.camera
        view = view_of(camera, state, frame)
        joints = list(camera_groups(camera, state, view))
        groups = [*joints, *posture_groups(self.constants, state)]
        common = robust_update(state, groups, self.constants.frame_update)
        update_tracker_errors(self.constants.tracker_errors, state, view, joints, common)
        lowest = min(view.positions[FEET, 2])
        kept = np.exp(-view.gap_s / FOOT_HEIGHT_S)
        before = np.where(np.isfinite(state.foot_height), state.foot_height, lowest)
        state.foot_height[:] = kept * before + (1.0 - kept) * lowest
        if joints:
            self._estimate_shared_offsets(view)
        information = np.zeros((len(state.imus.heading), 3, 3))
        for group in joints:
            for link in range(len(information)):
                part = group.H[:, link_columns(link)]
                information[link] += 3.0 * group.weight / np.trace(group.noise) * part.T @ part
        turned, seen = self._undo_half_turns(), np.array([group.nis for group in joints])
        if not joints:
            return StepResult(True, turned, np.nan, np.nan), information
        mean_nis = float(np.mean(np.minimum(seen, MEAN_NIS_CLIP)))
        return StepResult(True, turned, mean_nis, float(np.mean(seen > LOST_NIS))), information

    def _process_noise(self, dt_s: float, keep_slide: float) -> FloatArray:
        """Q of one time step, (n, n)."""
        motion, state = self.constants.motion, self.state
        slides, velocity = columns(state)
        shared = np.kron(block_diag(motion.root_power, motion.power), np.eye(3))
        Q = np.zeros_like(state.P)
        place, rate = slice(0, slides), slice(velocity, velocity + slides)
        Q[place, place], Q[rate, rate] = dt_s**3 / 3.0 * shared, dt_s * shared
        Q[place, rate] = Q[rate, place] = dt_s**2 / 2.0 * shared
        for i in range(slides, velocity):
            Q[i, i] = motion.slide_variance[(i - slides) // 3] * (1.0 - keep_slide**2)
        for own in state.imus.column[state.imus.column >= 0]:
            Q[own : own + 3, own : own + 3] = dt_s * motion.alignment_walk * np.eye(3)
        return Q

    def _predict_headings(self, dt_s: float) -> None:
        """Advance each IMU's heading together with its drift."""
        state, imus, motion = self.state, self.state.imus, self.constants.motion
        F = np.array([[1.0, dt_s], [0.0, 1.0]])
        noise = dt_s * np.diag([motion.heading_walk, motion.heading_drift_walk])
        for link in np.flatnonzero(imus.column >= 0):
            own = imus.column[link] + 3
            imus.heading[link], imus.drift[link] = F @ [imus.heading[link], imus.drift[link]]
            shared = imus.drift_covariance[link]
            before = np.array([[state.P[own, own], shared], [shared, imus.drift_variance[link]]])
            (state.P[own, own], imus.drift_covariance[link]), (_, imus.drift_variance[link]) = (
                F @ before @ F.T + noise
            )

    def _estimate_shared_offsets(self, view: PlainView) -> None:
        """Update the mean of the waist; a common rotation of both lines is taken as an offset."""
        state, constants = self.state, self.constants.shared_offsets
        gap_s = view.gap_s / len(state.views.silent_s)
        state.shared.waist_s[0] = min(state.shared.waist_s[0] + gap_s, WAIST_MEMORY_S)
        if state.shared.waist_s[0] == 0.0:
            return
        place = dict(zip(JOINTS, view.positions, strict=True))
        across = place["left_hip"] - place["right_hip"]
        up = place["neck"] - 0.5 * (place["left_hip"] + place["right_hip"])
        cosine = across @ up / np.linalg.norm(across) / np.linalg.norm(up)
        x, y, _ = view.rotations[constants.trunk].T @ across
        seen = np.array([np.arccos(cosine) - 0.5 * np.pi, np.arctan2(x, y)])
        hips = np.full(2, constants.hips_variance)
        shoulders = np.array([0.0, constants.shoulders_variance])
        total = hips + shoulders + constants.mean_variance + WAIST_MOTION / state.shared.waist_s[0]
        weight = np.minimum(
            (WAIST_DOF + 1.0) / (WAIST_DOF + state.shared.waist_mean**2 / total), 1.0
        )
        uncorrected = seen + (hips + shoulders) * weight / total * state.shared.waist_mean
        state.shared.waist_mean[:] += (
            gap_s / state.shared.waist_s[0] * (uncorrected - state.shared.waist_mean)
        )
        for line, half, error in (
            ("hip", constants.half_hips, -hips * weight / total * state.shared.waist_mean),
            (
                "shoulder",
                constants.half_shoulders,
                shoulders * weight / total * state.shared.waist_mean,
            ),
        ):
            for side, y in (("left", half), ("right", -half)):
                turn = np.array([error[0], 0.0, error[1]])
                offset = np.cross(turn, [0.0, y, 0.0])
                state.shared.offset[JOINTS.index(f"{side}_{line}")] = offset

    def _undo_half_turns(self) -> int:
        """Rotate links without IMUs that are half a turn off about their axes; their number."""
        state, count = self.state, 0
        half = np.diag([-1.0, -1.0, 1.0])
        for parent, link, sign in hinges(self.constants.posture):
            pair, has_imu = [parent, link], state.imus.is_used[[parent, link]]
            upper, lower = state.pose.rotations[pair]
            if not np.all(has_imu) and upper[:, 1] @ lower[:, 1] < OPPOSITE:
                turned = parent if has_imu[1] else link
                state.pose.rotations[turned] = state.pose.rotations[turned] @ half
                count += 1
            upper, lower = state.pose.rotations[pair]
            bend = flexion(upper.T @ lower, sign)
            if not np.any(has_imu) and bend < self.constants.posture.wrong_bend:
                state.pose.rotations[pair] = state.pose.rotations[pair] @ half
                count += 1
        return count


def robust_update(
    state: FilterState, groups: list[Group], constants: UpdateConstants
) -> tuple[float, float]:
    """Robust measurement update; the estimated error that the rows share, and its variance [-]."""
    H, residual = np.vstack([g.H for g in groups]), np.concatenate([g.residual for g in groups])
    c = np.concatenate([np.broadcast_to(g.common, len(g.residual)) for g in groups])
    P = state.P
    starts = np.cumsum([0, *(len(group.residual) for group in groups)])
    rows = [slice(a, b) for a, b in pairwise(starts)]

    def reweight(group: Group, squared: float) -> None:
        dof, size = group.student_dof, len(group.residual)
        if dof is not None:
            group.weight = np.clip((dof + size) / (dof + squared), constants.least_weight, 1.0)

    for own, group in zip(rows, groups, strict=True):
        group.spread = group.H @ P @ group.H.T
        expected = group.spread + np.outer(c[own], c[own]) + group.noise
        group.nis = mahalanobis(group.residual, expected)
        reweight(group, group.nis)
    for iteration in range(constants.iterations):
        R = np.zeros((len(H), len(H)))
        for own, group in zip(rows, groups, strict=True):
            R[own, own] = group.noise / group.weight
        S = H @ P @ H.T + np.outer(c, c) + R
        K = np.linalg.solve(S, H @ P).T
        if iteration == constants.iterations - 1:
            break
        left = R @ np.linalg.solve(S, residual)
        for own, group in zip(rows, groups, strict=True):
            reweight(group, mahalanobis(left[own], group.noise))
    rest = np.eye(len(P)) - K @ H
    posterior = rest @ P @ rest.T + K @ (R + np.outer(c, c)) @ K.T
    update_drifts(state.imus, np.diag(P), np.diag(posterior), K @ residual)
    state.P[:] = posterior
    inject_error(state, K @ residual)
    gain = np.linalg.solve(S, c)
    return float(gain @ residual), float(1.0 - gain @ c)


def update_drifts(imus: LinkImus, before: FloatArray, after: FloatArray, error: FloatArray) -> None:
    """Update the headings' drifts, of which only the headings tell; variances of all, (n,)."""
    for link in np.flatnonzero(imus.column >= 0):
        own = imus.column[link] + 3
        if before[own] > 0.0:
            slope = imus.drift_covariance[link] / before[own]
            apart = imus.drift_variance[link] - slope * imus.drift_covariance[link]
            imus.drift[link] += slope * error[own]
            imus.drift_variance[link] = apart + slope**2 * after[own]
            imus.drift_covariance[link] = slope * after[own]


def mahalanobis(values: FloatArray, covariance: FloatArray) -> float:
    """Squared Mahalanobis distance [-]."""
    return float(values @ np.linalg.solve(covariance, values))


def inject_error(state: FilterState, error: FloatArray) -> None:
    """Add an error, (n,), to the mean: rotations about map's axes, alignments about the link's."""
    pose, (slides, velocity) = state.pose, columns(state)
    turns = Rotation.from_rotvec(error[3:slides].reshape(-1, 3))
    pose.rotations[:] = (turns * Rotation.from_matrix(pose.rotations)).as_matrix()
    pose.position[:] += error[:3]
    pose.slides[:] += error[slides:velocity].reshape(-1, 3)
    pose.velocity[:] += error[velocity : velocity + 3]
    pose.rates[:] += error[velocity + 3 : velocity + slides].reshape(-1, 3)
    for link in np.flatnonzero(state.imus.column >= 0):
        own = int(state.imus.column[link])
        state.imus.R_sensor_link[link] @= Rotation.from_rotvec(error[own : own + 3]).as_matrix()
        state.imus.heading[link] += error[own + 3]
    for joint in np.flatnonzero(state.shared.column >= 0):
        own = int(state.shared.column[joint])
        state.shared.offset[joint] += error[own : own + 3]
