r"""The filter of the default estimator: links' rotations on the manifold, sensors as they come.

Prediction: constant rates that die away, :math:`\dot\omega = -\omega/\tau + w`, where a link's
white acceleration w goes in part along with its parent's. Update in information form: everything
measured at an instant at once,

.. math:: P^{+} = (P^{-1} + \sum H^T R^{-1} H)^{-1}, \quad e = P^{+} \sum H^T R^{-1} r

and the error e is added to the state on the manifold. The measurement models are linear in the
links' rotations up to second order, so one step suffices; see docs/algorithm.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_common.joints import TrackingState
from pose_fusion.body.kinematics import rotation_from_vector, skew
from pose_fusion.body.segment_tree import SegmentTree, flexion, without_side
from pose_fusion.filters.posture import Posture, PosturePrior
from pose_fusion.filters.segment_state import Layout, SegmentState
from pose_fusion.filters.tracker_model import (
    TrackerNoise,
    covariances,
    foreshortening,
    inertia,
    student_weights,
)
from pose_fusion.streams.samples import FloatArray

FRAME_PERIOD_S = 1.0 / 30.0  # for which accelerations are meant as white
WRONG_BEND = np.radians(-35.0)  # a hinge bent further the wrong way is a limb turned by half a turn
LARGEST_STDDEV = np.radians(60.0)  # an unseen turn grows no further
REOPENED_RATE_STDDEV = 1.0  # [rad/s]
HALF_TURN = np.diag([-1.0, -1.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class MotionPrior:
    """How people move; docs/algorithm.md says where each number comes from."""

    root_acceleration: float = 6.6  # [m/s²]
    acceleration: dict[str, float] = field(  # [rad/s²] by link, without its side
        default_factory=lambda: {
            "pelvis": 5.4,
            "trunk": 20.0,
            "head": 22.0,
            "upper_arm": 30.0,
            "forearm": 36.0,
            "thigh": 19.0,
            "shank": 28.0,
        }
    )
    carried: dict[str, float] = field(  # [-] share of the parent's acceleration that a link takes
        default_factory=lambda: {
            "pelvis": 0.0,
            "trunk": 0.5,
            "head": 0.0,
            "upper_arm": 0.1,
            "forearm": 0.9,
            "thigh": 0.6,
            "shank": 0.13,
        }
    )
    rate_memory: float = 0.2  # [s] in which rates die away
    slide_stddev: float = 0.02  # [m] of the shoulders on the clavicles
    slide_memory: float = 0.5  # [s]
    start_position_stddev: float = 0.03  # [m]
    start_angle_stddev: float = 0.15  # [rad]
    start_velocity_stddev: float = 0.2  # [m/s]
    start_rate_stddev: float = 0.5  # [rad/s]


@dataclass(frozen=True, kw_only=True)
class CameraLook:
    """One camera's view of one instant."""

    positions: FloatArray  # (15, 3) [m] in map; NaN unseen
    tracking_state: NDArray[np.uint8]  # (15,)
    camera: FloatArray  # (3,) [m] in map
    offsets: FloatArray  # (15, 3) [m] the tracker's own, in the axes of the root's heading
    delay_s: float  # [s] how far before the filter's instant this was


@dataclass(frozen=True, kw_only=True)
class LinkLook:
    """One IMU's view of its link."""

    link: int
    R_map_link: FloatArray  # (3, 3)
    variance: FloatArray  # (3,) [rad²] about map's axes
    angular_velocity: FloatArray  # (3,) [rad/s] in map
    rate_variance: float  # [rad²/s²]


@dataclass(frozen=True, kw_only=True)
class UpdateReport:
    """What an update did."""

    distance: FloatArray  # (15,) squared Mahalanobis distance of each joint; NaN unseen
    information: FloatArray  # (2, links, 3, 3) [1/rad²] of the Kinects and of the IMUs
    flipped: int  # limbs turned by half a turn


class SegmentFilter:
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
        names = tree.model.link_names
        self.layout = Layout(len(names), len(tree.sliding_links))
        self._posture = Posture(tree, self.layout, posture or PosturePrior())
        self._power = self._acceleration_power()
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

    def reopen(self, links: Sequence[int]) -> None:
        """Forget what is known of some links' rotations: they are elsewhere."""
        P = self._known_state().covariance
        for link in links:
            for where, stddev in (
                (self.layout.rotation(link), LARGEST_STDDEV),
                (self.layout.rate(link), REOPENED_RATE_STDDEV),
            ):
                P[where], P[:, where] = 0.0, 0.0
                P[where, where] = stddev**2 * np.eye(3)

    def joints(self) -> FloatArray:
        """Joint positions [m] in map, shape (15, 3), with the shoulders' slides."""
        state = self._known_state()
        levers = self.tree.levers(state.rotations, state.slides)
        return np.asarray(state.position + levers.sum(axis=1))

    def update(
        self, cameras: Sequence[CameraLook] = (), imus: Sequence[LinkLook] = ()
    ) -> UpdateReport:
        """Take everything that is known of the filter's instant.

        Raises:
            numpy.linalg.LinAlgError: If the covariance lost its positive definiteness.
        """
        state, layout = self._known_state(), self.layout
        information = np.zeros((layout.size, layout.size))
        vector = np.zeros(layout.size)
        distance = np.full(len(self.tree.offsets), np.nan)
        for look in cameras:
            seen, found = self._add_camera(look, information, vector)
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
        state.move(state.covariance @ vector, layout)
        return UpdateReport(
            distance=distance,
            information=np.stack([kinect_information, imu_information]),
            flipped=self._turn_back(),
        )

    def _add_camera(
        self, look: CameraLook, information: FloatArray, vector: FloatArray
    ) -> tuple[NDArray[np.bool_], FloatArray]:
        """Add what a camera says; returns which joints it saw and how far off they were."""
        state, layout, tau_s = self._known_state(), self.layout, look.delay_s
        rotations = rotation_from_vector(-tau_s * state.rates) @ state.rotations
        position = state.position - tau_s * state.velocity
        levers = self.tree.levers(rotations, state.slides)
        H = self._jacobian(levers, rotations)
        joints = position + levers.sum(axis=1)
        turning = H[:, :, layout.rotations] @ state.rates.ravel()
        rays = joints - look.camera
        rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        velocity = state.velocity + turning
        pointing = foreshortening(joints, rays)
        relative = joints - position
        if self._memory is None:
            self._memory = relative
        share = inertia(self.noise, np.linalg.norm(velocity, axis=1), pointing, look.tracking_state)
        H[:, :, 3:] *= (1.0 - share)[:, None, None]
        expected = joints + share[:, None] * (self._memory - relative)
        expected = expected + look.offsets @ _about_up(rotations[0]).T
        R = covariances(self.noise, rays, velocity, pointing, look.tracking_state)
        seen = np.isfinite(look.positions[:, 0]) & (
            look.tracking_state != TrackingState.NOT_TRACKED
        )
        H, R, residual = H[seen], R[seen], (look.positions - expected)[seen]
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

    def _add_imus(
        self, imus: Sequence[LinkLook], information: FloatArray, vector: FloatArray
    ) -> None:
        state, layout = self._known_state(), self.layout
        for look in imus:
            turn = Rotation.from_matrix(look.R_map_link @ state.rotations[look.link].T).as_rotvec()
            where, rate = layout.rotation(look.link), layout.rate(look.link)
            information[where, where] += np.diag(1.0 / look.variance)
            vector[where] += turn / look.variance
            information[rate, rate] += np.eye(3) / look.rate_variance
            vector[rate] += (look.angular_velocity - state.rates[look.link]) / look.rate_variance

    def _of_links(self, information: FloatArray) -> FloatArray:
        """The links' own blocks, shape (links, 3, 3)."""
        links = self.layout.links
        blocks = information[self.layout.rotations, self.layout.rotations]
        each = np.arange(links)
        return blocks.reshape(links, 3, links, 3)[each, :, each, :].copy()

    def _turn_back(self) -> int:
        """Undo a limb's half turn about itself: its hinge would bend the wrong way."""
        rotations = self._known_state().rotations
        flipped = 0
        for hinge in self.tree.hinges:
            R_parent_link = rotations[hinge.parent].T @ rotations[hinge.link]
            if flexion(R_parent_link, hinge.sign) < WRONG_BEND:
                rotations[hinge.parent] = rotations[hinge.parent] @ HALF_TURN
                rotations[hinge.link] = rotations[hinge.link] @ HALF_TURN
                flipped += 1
        return flipped

    def _remember(self, dt_s: float) -> None:
        """Follow each joint's recent mean place, relative to the root."""
        if self._memory is None:
            return
        share = 1.0 - float(np.exp(-dt_s / self.noise.memory))
        relative = self.joints() - self._known_state().position
        self._memory = self._memory + share * (relative - self._memory)

    def _acceleration_power(self) -> FloatArray:
        """Power of the white accelerations, shape (moving size, moving size)."""
        motion, links = self._motion, self.layout.links
        kinds = [without_side(name) for name in self.tree.model.link_names]
        own = np.array([motion.acceleration[kind] for kind in kinds])
        path = np.eye(links)
        for link, parent in enumerate(self.tree.parents):
            if parent >= 0:
                path[link] += motion.carried[kinds[link]] * path[parent]
        power = np.zeros((3 + 3 * links, 3 + 3 * links))
        power[:3, :3] = motion.root_acceleration**2 * np.eye(3)
        power[3:, 3:] = np.kron((path * own**2) @ path.T, np.eye(3))
        return power * FRAME_PERIOD_S

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
