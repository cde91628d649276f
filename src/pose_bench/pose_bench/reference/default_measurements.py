r"""Reference implementation of the default filter's measurement models in plain numpy.

Independent implementation of the equations of ``pose_core.filter``: slow, one group of rows at a
time, without the compiled arithmetic.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray
from pose_core.filter.camera import CameraConstants
from pose_core.filter.constants import FilterConstants
from pose_core.filter.frame import CameraFrame
from pose_core.filter.imu import ImuConstants, ImuFrame
from pose_core.filter.occlusion import Capsules
from pose_core.filter.posture import PostureConstants
from pose_core.filter.sigma_points import ALPHA, BETA
from pose_core.filter.state import FilterState
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.joint_kinematics import BodyArrays

MAX_STEP_S = 0.1  # [s]
FASTEST_LINK = 6.0  # [rad/s] above which noise is constant
HELD_JERK = 100.0  # [rad/s³]
SOFTNESS, STAND_OFF, MIN_DEFINED = 0.02, 0.06, 1e-3  # [m], [m], [-]
HINGE_DOF = 3.0  # [-]
FEET = [JOINT_INDEX["left_foot"], JOINT_INDEX["right_foot"]]


@dataclass(kw_only=True)
class Group:
    """One or three rows with a common weight."""

    H: FloatArray  # (d, n)
    residual: FloatArray  # (d,)
    noise: FloatArray  # (d, d)
    student_dof: float | None = None  # None: normal
    source: int = -1  # joint or link
    common: FloatArray | float = 0.0  # (d,) derivatives with respect to an error of all groups
    weight: float = 1.0  # [-] these three by the update
    nis: float = np.nan  # [-] normalised innovation squared
    spread: FloatArray = field(default_factory=lambda: np.empty((0, 0)))  # (d, d) H P Hᵀ


@dataclass(kw_only=True)
class PlainView:
    """The joints predicted for a frame's instant of capture."""

    frame: CameraFrame
    gap_s: float  # [s] since the camera's last frame
    rotations: FloatArray  # (links, 3, 3)
    levers: FloatArray  # (joints, links, 3) [m]
    positions: FloatArray  # (joints, 3) [m]
    velocity: FloatArray  # (joints, 3) [m/s]
    occlusion: FloatArray  # (joints,) [-]

    def heading(self) -> FloatArray:
        """The root's heading, (3, 3)."""
        x, y = self.rotations[0, :2, 0]
        return heading_matrix(np.arctan2(y, x))

    def ray(self, joint: int) -> FloatArray:
        """Direction from the camera to a joint, (3,)."""
        ray = self.positions[joint] - self.frame.camera
        return np.asarray(ray / np.linalg.norm(ray))


def heading_matrix(angle: float) -> FloatArray:
    """Rotation about map's z axis, (3, 3)."""
    return Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()


def columns(state: FilterState) -> tuple[int, int]:
    """First columns of the slides and of the velocity."""
    slides = 3 + 3 * len(state.imus.heading)
    return slides, slides + 3 * len(state.pose.slides)


def link_columns(link: int) -> slice:
    """Columns of a link's rotation in the error; those of its rate follow from the velocity's."""
    return slice(3 + 3 * link, 6 + 3 * link)


def imu_groups(constants: ImuConstants, state: FilterState, imus: ImuFrame) -> Iterator[Group]:
    """Each aligned IMU's orientation and rate."""
    _, velocity = columns(state)
    for row, link in enumerate(imus.links):
        own = int(state.imus.column[link])
        R_map_sensor = heading_matrix(state.imus.heading[link]) @ imus.R_world_sensor[row]
        Q = R_map_sensor @ state.imus.R_sensor_link[link]
        rate = R_map_sensor @ imus.angular_velocity[row]
        speed, age_s = min(float(np.linalg.norm(rate)), FASTEST_LINK), imus.age_s[row]
        factor = state.imus.noise[link]
        stddev = factor * (constants.stddev[link] + constants.soft_tissue * speed)
        held = HELD_JERK * age_s**3 / 3.0
        noise = Q @ np.diag(constants.correlated_samples * stddev**2 + held**2) @ Q.T
        H = np.zeros((3, len(state.P)))
        H[:, link_columns(link)] = np.eye(3)
        H[:, own : own + 3] = -Q
        H[2, own + 3] = -1.0
        yield Group(
            H=H,
            residual=Rotation.from_matrix(Q @ state.pose.rotations[link].T).as_rotvec(),
            noise=noise,
            student_dof=constants.student_dof,
            source=int(link),
        )
        H = np.zeros((3, len(state.P)))
        H[:, velocity : velocity + 3 + 3 * len(state.imus.heading)][:, link_columns(link)] = np.eye(
            3
        )
        variance = (factor * constants.rate_stddev[link]) ** 2 * (1.0 + 0.25 * speed**2)
        variance += (HELD_JERK * age_s**2) ** 2 + imus.rate_stddev[row] ** 2
        noise = Q @ np.diag(variance) @ Q.T
        yield Group(H=H, residual=rate - state.pose.rates[link], noise=noise)


def view_of(constants: CameraConstants, state: FilterState, frame: CameraFrame) -> PlainView:
    """The joints that a frame measures."""
    pose = state.pose
    rotations = pose.rotations.copy()
    levers = levers_of(constants.body, rotations, pose.slides)
    positions = pose.position + levers.sum(axis=1)
    return PlainView(
        frame=frame,
        gap_s=min(state.views.silent_s[frame.sensor], MAX_STEP_S),
        rotations=rotations,
        levers=levers,
        positions=positions,
        velocity=pose.velocity + np.cross(pose.rates, levers).sum(axis=1),
        occlusion=hidden(constants.capsules, positions, frame.camera),
    )


def levers_of(body: BodyArrays, rotations: FloatArray, slides: FloatArray) -> FloatArray:
    """Contribution of each link to each joint, R_l (o_jl + s_jl), (joints, links, 3) [m]."""
    offsets = np.array(body.offsets)
    for slide, link in enumerate(body.sliding_links):
        offsets[:, link] += np.outer(body.slides[:, slide], slides[slide])
    return np.einsum("lik,jlk->jli", rotations, offsets)


def hidden(capsules: Capsules, places: FloatArray, camera: FloatArray) -> FloatArray:
    """Degree to which the body hides each joint from a camera, (joints,) [-]."""
    result = np.zeros(len(places))
    for joint, place in enumerate(places):
        sight = place - camera
        end = camera + sight * (1.0 - STAND_OFF / np.linalg.norm(sight))
        for part in np.flatnonzero(capsules.hides[joint]):
            first, last = places[capsules.ends[part]]
            depth = capsules.radius[part] - segments_apart(camera, end, first, last)
            if depth > -6.0 * SOFTNESS:
                result[joint] = max(result[joint], 1.0 / (1.0 + np.exp(-depth / SOFTNESS)))
    return result


def segments_apart(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> float:
    """Distance [m] of the segments ab and cd: between their lines, or from an end."""
    directions = np.stack([b - a, c - d], axis=1)
    shares = np.linalg.lstsq(directions, c - a, rcond=None)[0]
    if np.all((shares >= 0.0) & (shares <= 1.0)):
        return float(np.linalg.norm(directions @ shares - (c - a)))
    ends = (point_apart(a, c, d), point_apart(b, c, d), point_apart(c, a, b), point_apart(d, a, b))
    return min(ends)


def point_apart(p: FloatArray, a: FloatArray, b: FloatArray) -> float:
    """Distance [m] of a point from the segment ab."""
    share = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return float(np.linalg.norm(a + share * (b - a) - p))


def camera_groups(
    constants: CameraConstants, state: FilterState, view: PlainView
) -> Iterator[Group]:
    """Measurements of the joints in a frame."""
    frame = view.frame
    for joint, seen in enumerate(frame.positions):
        if frame.tracking_state[joint] == 0 or not np.all(np.isfinite(seen)):
            continue
        heading = view.heading()
        offset = state.views.offset[frame.sensor, joint] + state.shared.offset[joint]
        H, shift, unfitted = joint_regression(constants.body, state, view, joint)
        own = int(state.shared.column[joint])
        if own >= 0:
            H[:, own : own + 3] = heading
        ray = view.ray(joint)
        noise = joint_variance(constants, state, view, joint) * np.eye(3) + unfitted
        error, variance = (
            state.views.depth_error[frame.sensor],
            state.views.depth_error_variance[frame.sensor],
        )
        yield Group(
            H=H,
            residual=seen - view.positions[joint] - shift - heading @ offset - error * ray,
            noise=noise + state.views.depth_noise[frame.sensor] * np.outer(ray, ray),
            common=np.sqrt(variance) * ray,
            student_dof=constants.student_dof,
            source=joint,
        )


def joint_regression(
    body: BodyArrays, state: FilterState, view: PlainView, joint: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Statistical linearisation of a joint by filterpy's sigma points and weights.

    Returns:
        H, (3, n); offset of the mean from the centre, (3,) [m]; covariance of the residuals.
    """
    carriers = body.carriers[joint, : body.carrier_count[joint]]
    spread = np.concatenate([np.arange(3 + 3 * link, 6 + 3 * link) for link in carriers])
    P = state.P[np.ix_(spread, spread)]
    points = MerweScaledSigmaPoints(len(P), ALPHA, BETA, 0.0)
    errors = points.sigma_points(np.zeros(len(P)), P)
    turns = Rotation.from_rotvec(errors.reshape(-1, 3)).as_matrix().reshape(-1, len(carriers), 3, 3)
    places = np.einsum("nlik,lk->ni", turns, view.levers[joint, carriers])
    apart = places - points.Wm @ places
    regression = np.linalg.solve(P, (points.Wc[:, None] * errors).T @ apart).T
    unfitted = (points.Wc[:, None] * apart).T @ apart - regression @ P @ regression.T
    slides = columns(state)[0]
    H = np.zeros((3, len(state.P)))
    H[:, :3] = np.eye(3)
    H[:, spread] = regression
    for slide, link in enumerate(body.sliding_links):
        at = slides + 3 * slide
        H[:, at : at + 3] = body.slides[joint, slide] * view.rotations[link]
    return H, points.Wm @ places - places[0], unfitted


def has_other_source(
    constants: CameraConstants, state: FilterState, sensor: int, joint: int
) -> bool:
    """Whether another camera sends frames, or an IMU is on the joint's link."""
    others = np.delete(state.views.silent_s, sensor)
    link = np.flatnonzero(np.any(constants.body.offsets[joint] != 0.0, axis=1))[-1]
    return bool(np.any(others < 0.15) or state.imus.is_used[link])


def joint_variance(
    constants: CameraConstants, state: FilterState, view: PlainView, joint: int
) -> float:
    """Variance of a joint's measurement in each direction [m²]."""
    frame = view.frame
    scale = np.clip(np.sqrt(state.views.noise[0]), 0.25, 2.0)
    variance = scale * constants.variance + state.views.offset_variance[frame.sensor, joint]
    if has_other_source(constants, state, frame.sensor, joint):
        variance += constants.occluded_variance * view.occlusion[joint] ** 2
    if frame.tracking_state[joint] == 1:
        variance += constants.inferred_variance
    return float(variance)


def posture_groups(constants: FilterConstants, state: FilterState) -> Iterator[Group]:
    """The posture prior: hinges, twists, the spine."""
    posture, rotations = constants.posture, state.pose.rotations
    for parent, link, _ in hinges(posture):
        yield from hinge_groups(posture, state, parent, link)
    twists = zip(posture.twist_parents, posture.twist_links, posture.twist_variance, strict=True)
    for parent, link, variance in twists:
        _, _, z, w = quaternion(rotations[parent].T @ rotations[link])
        defined = max(min(1.0, w * w + z * z), MIN_DEFINED)
        angle = 2.0 * np.arctan2(z, w)
        yield turn(state, parent, link, rotations[link, :, 2], -angle, variance / defined**2)
    for parent, link in zip(posture.spine_parents, posture.spine_links, strict=True):
        bend = Rotation.from_matrix(rotations[parent].T @ rotations[link]).as_rotvec()
        for k, axis in enumerate(rotations[parent].T):
            yield turn(state, parent, link, axis, -bend[k], posture.spine_variance[k])


def standing_foot_groups(body: BodyArrays, state: FilterState) -> Iterator[Group]:
    """The root's velocity and height by the feet, as if they stood."""
    carriers = [np.flatnonzero(np.any(body.offsets[foot] != 0.0, axis=1)) for foot in FEET]
    if not all(state.imus.is_used[links[1:]].all() for links in carriers):
        return
    levers = levers_of(body, state.pose.rotations, state.pose.slides)[FEET]
    height = levers.sum(axis=1)[:, 2]
    for arms, links in zip(levers, carriers, strict=True):
        arms[links[-1]] *= 1.2
    carried = -np.cross(state.pose.rates, levers).sum(axis=1)
    apart = np.linalg.norm(carried - state.pose.velocity, axis=1)
    weights = 1.0 / ((1.0 + (height - min(height)) / 0.1) ** 2 * (1.0 + (apart / 0.3) ** 2))
    H = np.zeros((3, len(state.P)))
    velocity = columns(state)[1]
    H[:, velocity : velocity + 3] = np.eye(3)
    yield Group(
        H=H,
        residual=weights @ carried / weights.sum() - state.pose.velocity,
        noise=0.01 * np.eye(3),
    )
    if np.isfinite(state.foot_height[0]):
        above = state.pose.position[2] + min(height)
        H = np.eye(1, len(state.P), 2)
        yield Group(H=H, residual=state.foot_height - above, noise=np.array([[0.05**2]]))


def hinges(posture: PostureConstants) -> Iterator[tuple[int, int, float]]:
    """Parent, link and sign of each hinge."""
    yield from zip(*posture.hinges, strict=True)


def hinge_groups(
    posture: PostureConstants, state: FilterState, parent: int, link: int
) -> Iterator[Group]:
    """The plane of a hinge."""
    upper, lower = state.pose.rotations[parent], state.pose.rotations[link]
    for p in (upper[:, 0], upper[:, 2]):
        u, variance = lower[:, 1], posture.hinge_variance
        row = turn(state, parent, link, np.cross(u, p), -(p @ u), variance)
        row.student_dof = HINGE_DOF
        yield row


def turn(
    state: FilterState, parent: int, link: int, axis: FloatArray, residual: float, variance: float
) -> Group:
    """Measurement of a link's rotation relative to its parent about an axis in map."""
    H = np.zeros((1, len(state.P)))
    H[0, link_columns(link)], H[0, link_columns(parent)] = axis, -axis
    return Group(H=H, residual=np.array([residual]), noise=np.array([[variance]]))


def flexion(R_parent_link: FloatArray, sign: float) -> float:
    """A hinge's angle [rad]: the twist about +y, by swing and twist."""
    _, y, _, w = quaternion(R_parent_link)
    return float(sign * 2.0 * np.arctan2(y, w))


def quaternion(R: FloatArray) -> FloatArray:
    """(x, y, z, w) with w ≥ 0."""
    return Rotation.from_matrix(R).as_quat(canonical=True)
