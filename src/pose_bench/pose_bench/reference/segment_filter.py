"""The default estimator's filter in plain numpy: see ``pose_core.filters.segment_filter``.

Nothing of the compiled kernels is used: whole matrices, library rotations, inverses.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_bench.reference.posture import Posture, flexion
from pose_bench.reference.tracker import covariances, foreshortening, inertia, student_weights
from pose_core.body.kinematics import rotation_from_vector, skew
from pose_core.body.segment_tree import SegmentTree
from pose_core.filters.looks import CameraLooks, LinkLooks, Outcome, UpdateReport
from pose_core.filters.motion_prior import MotionPrior, acceleration_power
from pose_core.filters.posture import PosturePrior
from pose_core.filters.segment_filter import NO_CAMERAS, NO_IMUS
from pose_core.filters.segment_state import Layout, SegmentState
from pose_core.filters.tracker_model import TrackerNoise
from pose_core.joints import TrackingState
from pose_core.streams.samples import FloatArray

MOST = 20.0  # [-] a squared distance that counts no more than that, in the mean
WRONG_BEND = np.radians(-35.0)  # a hinge bent further the wrong way is a limb turned by half a turn
LARGEST_STDDEV = np.radians(60.0)  # an unseen turn grows no further


class ReferenceFilter:
    """One person's pose, rates and covariance.

    Args:
        tree: The body with its measures.
        motion: How people move.
        noise: What trackers get wrong.
        posture: What is known beforehand.
    """

    def __init__(
        self,
        tree: SegmentTree,
        motion: MotionPrior | None = None,
        noise: TrackerNoise | None = None,
        posture: PosturePrior | None = None,
    ) -> None:
        self.tree = tree
        self.noise = noise or TrackerNoise()
        self._motion = motion or MotionPrior()
        self.layout = Layout(len(tree.parents), len(tree.sliding_links))
        self._posture = Posture(tree, self.layout, posture or PosturePrior())
        self._power = acceleration_power(self._motion, tree)
        self._memory: FloatArray | None = None
        self.state: SegmentState | None = None

    def start(self, R_map_links: FloatArray, position: FloatArray) -> None:
        """Begin at a pose: ``R_map_link`` of all links, shape (links, 3, 3), and the root [m]."""
        motion, layout = self._motion, self.layout
        stddev = np.empty(layout.size)
        stddev[layout.position] = motion.start_position_stddev
        stddev[layout.rotations] = motion.start_angle_stddev
        stddev[layout.slide] = motion.slide_stddev
        stddev[layout.rates] = motion.start_rate_stddev
        stddev[layout.rates.start : layout.rates.start + 3] = motion.start_velocity_stddev
        self._memory = None
        self.state = SegmentState(
            position=position.copy(),
            rotations=R_map_links.copy(),
            slides=np.zeros((layout.slides, 3)),
            velocity=np.zeros(3),
            rates=np.zeros((layout.links, 3)),
            covariance=np.diag(stddev**2),
        )

    def predict(self, dt_s: float) -> None:
        """Go on by ``dt_s`` [s]."""
        state = self._known_state()
        keep = float(np.exp(-dt_s / self._motion.rate_memory))
        reach_s = self._motion.rate_memory * (1.0 - keep)
        keep_slide = float(np.exp(-dt_s / self._motion.slide_memory))
        state.position = state.position + reach_s * state.velocity
        state.rotations = rotation_from_vector(reach_s * state.rates) @ state.rotations
        state.slides = keep_slide * state.slides
        state.velocity, state.rates = keep * state.velocity, keep * state.rates
        self._predict_covariance(dt_s, keep, reach_s, keep_slide)
        self._remember(dt_s)

    def _predict_covariance(
        self, dt_s: float, keep: float, reach_s: float, keep_slide: float
    ) -> None:
        layout, P = self.layout, self._known_state().covariance
        moving, slide, rates = layout.moving, layout.slide, layout.rates
        # F P Fᵀ with F = [[1, reach], [0, keep]] over the moving part, and keep_slide.
        P[moving] += reach_s * P[rates]
        P[:, moving] += reach_s * P[:, rates]
        P[rates] *= keep
        P[:, rates] *= keep
        P[slide] *= keep_slide
        P[:, slide] *= keep_slide
        P[moving, moving] += dt_s**3 / 3.0 * self._power
        cross = dt_s**2 / 2.0 * self._power
        P[moving, rates] += cross
        P[rates, moving] += cross
        P[rates, rates] += dt_s * self._power
        index = np.arange(slide.start, slide.stop)
        P[index, index] += self._motion.slide_stddev**2 * (1.0 - keep_slide**2)
        self._bound(P)

    def _bound(self, P: FloatArray) -> None:
        """Keep what nothing sees where small-angle errors still mean something."""
        index = np.arange(self.layout.rotations.start, self.layout.rotations.stop)
        stddev = np.sqrt(P[index, index])
        if np.any(stddev > LARGEST_STDDEV):
            scale = np.ones(len(P))
            scale[index] = np.minimum(1.0, LARGEST_STDDEV / stddev)
            P *= np.outer(scale, scale)

    def joints(self) -> FloatArray:
        """Joint positions [m] in map, shape (15, 3), with the shoulders' slides."""
        state = self._known_state()
        levers = levers_of(self.tree, state.rotations, state.slides)
        return np.asarray(state.position + levers.sum(axis=1))

    def update(self, cameras: CameraLooks = NO_CAMERAS, imus: LinkLooks = NO_IMUS) -> UpdateReport:
        """Take everything that is known of the filter's instant.

        Raises:
            numpy.linalg.LinAlgError: If the covariance lost its positive definiteness.
        """
        state, layout = self._known_state(), self.layout
        information = np.zeros((layout.size, layout.size))
        vector = np.zeros(layout.size)
        distance = np.full(len(self.tree.offsets), np.nan)
        for camera in range(len(cameras.positions)):
            seen, found = self._add_camera(cameras, camera, information, vector)
            distance[seen] = found
        kinect_information = self._of_links(information)
        self._add_imus(imus, information, vector)
        imu_information = self._of_links(information) - kinect_information
        looks = self._posture.look(state.rotations)
        weighted = looks.C / looks.variance[:, None]
        information[layout.pose, layout.pose] += looks.C.T @ weighted
        vector[layout.pose] += looks.residual @ weighted
        P = np.linalg.inv(np.linalg.inv(state.covariance) + information)
        state.covariance = 0.5 * (P + P.T)
        _move(state, state.covariance @ vector, layout)
        seen = distance[np.isfinite(distance)]
        outcome = Outcome(
            is_definite=True,
            flipped=self._turn_back(),
            swapped=0,
            typical=float(np.mean(np.minimum(seen, MOST))) if len(seen) else np.nan,
            farthest=float(np.max(seen)) if len(seen) else np.nan,
        )
        return UpdateReport(
            outcome=outcome,
            distance=distance,
            information=np.stack([kinect_information, imu_information]),
        )

    def _add_camera(
        self, looks: CameraLooks, camera: int, information: FloatArray, vector: FloatArray
    ) -> tuple[NDArray[np.bool_], FloatArray]:
        """Add what a camera says; returns which joints it saw and how far off they were."""
        state, layout, tau_s = self._known_state(), self.layout, looks.delay_s
        positions, tracking_state = looks.positions[camera], looks.tracking_state[camera]
        rotations = rotation_from_vector(-tau_s * state.rates) @ state.rotations
        position = state.position - tau_s * state.velocity
        levers = levers_of(self.tree, rotations, state.slides)
        H = self._jacobian(levers, rotations)
        joints = position + levers.sum(axis=1)
        turning = H[:, :, layout.rotations] @ state.rates.ravel()
        rays = joints - looks.cameras[camera]
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        velocity = state.velocity + turning
        pointing = foreshortening(joints, rays)
        relative = joints - position
        if self._memory is None:
            self._memory = relative
        share = inertia(self.noise, np.linalg.norm(velocity, axis=1), pointing, tracking_state)
        H[:, :, 3:] *= (1.0 - share)[:, None, None]
        expected = joints + share[:, None] * (self._memory - relative)
        expected = expected + looks.offsets[camera] @ _about_up(rotations[0]).T
        R = covariances(self.noise, rays, velocity, pointing, tracking_state)
        seen = np.isfinite(positions[:, 0]) & (tracking_state != TrackingState.NOT_TRACKED)
        H, R, residual = H[seen], R[seen], (positions - expected)[seen]
        spread = H @ self._delayed_covariance(tau_s) @ H.transpose(0, 2, 1)
        factor, distance = student_weights(self.noise, residual, spread + R)
        W = np.linalg.inv(R * factor[:, None, None])
        WH = W @ H
        flat = H.reshape(-1, layout.pose_size)
        G = flat.T @ WH.reshape(-1, layout.pose_size)
        g = residual.ravel() @ WH.reshape(-1, layout.pose_size)
        pose, rates, moving = layout.pose, layout.rates, layout.moving
        # The camera saw the pose of tau ago: H e_pose − tau H e_rates.
        information[pose, pose] += G
        information[pose, rates] -= tau_s * G[:, moving]
        information[rates, pose] -= tau_s * G[moving]
        information[rates, rates] += tau_s**2 * G[moving, moving]
        vector[pose] += g
        vector[rates] -= tau_s * g[moving]
        return seen, distance

    def _jacobian(self, levers: FloatArray, rotations: FloatArray) -> FloatArray:
        """Derivative of the joints by the pose's error, shape (15, 3, pose size)."""
        layout, joints = self.layout, len(levers)
        H = np.zeros((joints, 3, layout.pose_size))
        H[:, :, layout.position] = np.eye(3)
        H[:, :, layout.rotations] = -skew(levers).transpose(0, 2, 1, 3).reshape(joints, 3, -1)
        for column, link in enumerate(self.tree.sliding_links):
            start = layout.slide.start + 3 * column
            goes_along = self.tree.slides[:, column, None, None]
            H[:, :, start : start + 3] = goes_along * rotations[link]
        return H

    def _delayed_covariance(self, tau_s: float) -> FloatArray:
        """Covariance of the pose of ``tau_s`` ago, shape (pose size, pose size)."""
        layout, P = self.layout, self._known_state().covariance
        result = P[layout.pose, layout.pose].copy()
        if tau_s:
            moving, rates = layout.moving, layout.rates
            cross = tau_s * P[layout.pose, rates]
            result[:, moving] -= cross
            result[moving] -= cross.T
            result[moving, moving] += tau_s**2 * P[rates, rates]
        return result

    def _add_imus(self, imus: LinkLooks, information: FloatArray, vector: FloatArray) -> None:
        state, layout = self._known_state(), self.layout
        for link, R_map_link, variance, speed, rate_variance in zip(*imus, strict=True):
            turn = Rotation.from_matrix(R_map_link @ state.rotations[link].T).as_rotvec()
            where, rate = layout.rotation(link), layout.rate(link)
            information[where, where] += np.diag(1.0 / variance)
            vector[where] += turn / variance
            information[rate, rate] += np.eye(3) / rate_variance
            vector[rate] += (speed - state.rates[link]) / rate_variance

    def _of_links(self, information: FloatArray) -> FloatArray:
        """The links' own blocks, shape (links, 3, 3)."""
        links = self.layout.links
        blocks = information[self.layout.rotations, self.layout.rotations]
        return blocks.reshape(links, 3, links, 3)[range(links), :, range(links), :].copy()

    def _turn_back(self) -> int:
        """Undo a limb's half turn about itself: its hinge would bend the wrong way."""
        rotations = self._known_state().rotations
        flipped = 0
        for hinge in self.tree.hinges:
            R_parent_link = rotations[hinge.parent].T @ rotations[hinge.link]
            if flexion(R_parent_link, hinge.sign) < WRONG_BEND:
                rotations[hinge.parent] = rotations[hinge.parent] * (-1.0, -1.0, 1.0)
                rotations[hinge.link] = rotations[hinge.link] * (-1.0, -1.0, 1.0)
                flipped += 1
        return flipped

    def _remember(self, dt_s: float) -> None:
        """Follow each joint's recent mean place, relative to the root."""
        if self._memory is None:
            return
        share = 1.0 - float(np.exp(-dt_s / self.noise.memory))
        relative = self.joints() - self._known_state().position
        self._memory = self._memory + share * (relative - self._memory)

    def _known_state(self) -> SegmentState:
        if self.state is None:
            raise RuntimeError("the filter has not been started")
        return self.state


def _about_up(R_map_root: FloatArray) -> FloatArray:
    """The turn of the root's heading about map's z, shape (3, 3)."""
    x, y = R_map_root[0, 0], R_map_root[1, 0]
    length = max(float(np.hypot(x, y)), 1e-9)
    c, s = x / length, y / length
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _move(state: SegmentState, error: FloatArray, layout: Layout) -> None:
    """Add an error, shape (size,)."""
    links = layout.links
    state.position = state.position + error[layout.position]
    turns = rotation_from_vector(error[layout.rotations].reshape(links, 3))
    state.rotations = turns @ state.rotations
    state.slides = state.slides + error[layout.slide].reshape(-1, 3)
    rates = error[layout.rates]
    state.velocity = state.velocity + rates[:3]
    state.rates = state.rates + rates[3:].reshape(links, 3)


def levers_of(tree: SegmentTree, rotations: FloatArray, slides: FloatArray) -> FloatArray:
    """What each link adds to each joint, in map.

    Args:
        tree: The body.
        rotations: ``R_map_link``, shape (links, 3, 3).
        slides: Of the sliding joints, in their links' axes, shape (sliding joints, 3) [m].

    Returns:
        Shape (15, links, 3) [m].
    """
    levers = np.einsum("lab,jlb->jla", rotations, tree.offsets)
    for column, link in enumerate(tree.sliding_links):
        levers[:, link] += np.outer(tree.slides[:, column], rotations[link] @ slides[column])
    return levers
