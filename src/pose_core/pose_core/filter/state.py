"""State of the default filter: mean, covariance and slowly varying quantities."""

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.filter.layout import Layout, rate_column, rotation_column
from pose_core.joints import JOINTS
from pose_core.kernels.compiling import compiled_in_place
from pose_core.kernels.rotations import rotate_left, rotate_right

if TYPE_CHECKING:  # so that an edited tuning needs no compilation
    from pose_core.filter.tuning import FilterTuning

IMU_STATES = 4  # sensor-to-segment rotation (3) and heading (1)
SHARED_OFFSET_STATES = 3
NO_COLUMN = -1
CAMERA_TIMEOUT_S = 0.15  # [s] after its last frame, a camera is ignored
LINK_RESIDUALS_AT_START = 0.3  # [rad²] uncorrelated ones that are credited to each IMU
SILENT_AT_START_S = 10.0  # [s] of a camera that has not sent any frame


class Pose(NamedTuple):
    """Mean of the body's part of the state."""

    position: FloatArray  # (3,) [m] of the root in map
    rotations: FloatArray  # (links, 3, 3) R_map_link
    slides: FloatArray  # (slides, 3) [m] displacements of joints in their links' axes
    velocity: FloatArray  # (3,) [m/s] of the root in map
    rates: FloatArray  # (links, 3) [rad/s] in map


class ViewErrors(NamedTuple):
    """What is learnt about each camera's view, see :mod:`pose_core.filter.tracker_errors`."""

    delay: FloatArray  # (sensors,) [s] of each tracker; subtracted from its stamps
    delay_sums: FloatArray  # (sensors, links, 2) [m²/s², m²/s] of the delay's regression
    depth_error: FloatArray  # (sensors,) [m] along its rays, see pose_core.filter.depth_errors
    depth_error_variance: FloatArray  # (sensors,) [m²]
    depth_error_power: FloatArray  # (sensors,) [m²] its mean square over time
    depth_noise: FloatArray  # (sensors,) [m²] variance of single joints along the rays, in addition
    noise: FloatArray  # (1,) [-] variance of the views' differences, relative to the usual
    residual: FloatArray  # (sensors, joints) [m] of the last frame, upwards; or NaN
    offset: FloatArray  # (sensors, joints, 3) [m] in the pelvis' heading frame
    offset_variance: FloatArray  # (sensors, joints) [m²]
    smoothed_nis: FloatArray  # (sensors, joints) normalised innovation squared [-]
    silent_s: FloatArray  # (sensors,) [s] since each camera's last frame
    apart: FloatArray  # (sensors, 3) [m] of its joints from the state's, on average


class LinkImus(NamedTuple):
    """The IMU of each link: its alignment, and what the cameras say of it."""

    R_sensor_link: FloatArray  # (links, 3, 3) its sensor-to-segment rotation
    heading: FloatArray  # (links,) [rad] of its reference frame in map, about z
    drift: FloatArray  # (links,) [rad/s] of the heading, see pose_core.filter.heading_drift
    drift_variance: FloatArray  # (links,) [rad²/s²]
    drift_covariance: FloatArray  # (links,) [rad²/s] with the heading
    column: NDArray[np.int64]  # (links,) first column of its error, or NO_COLUMN
    is_used: NDArray[np.bool_]  # (links,) whether an aligned IMU measures the link now
    noise: FloatArray  # (links,) [-] factor of its standard deviations, see imu_noise
    link_residual: FloatArray  # (sensors, links, 3) [rad] of each view's last frame; or NaN
    link_mean_residual: FloatArray  # (sensors, links, 3) [rad] its mean over time
    link_residual_sums: FloatArray  # (links, 2) [rad²] see pose_core.filter.imu_noise
    contradicted_s: FloatArray  # (links,) [s] for which all cameras have contradicted it


class SharedOffsets(NamedTuple):
    """Offsets that all views share."""

    offset: FloatArray  # (joints, 3) [m] in the pelvis' heading frame
    column: NDArray[np.int64]  # (joints,) first column of its error, or NO_COLUMN
    waist_mean: FloatArray  # (2,) [rad] of lateral bending and rotation, uncorrected
    waist_s: FloatArray  # (1,) [s] averaging time of that mean


class FilterState(NamedTuple):
    """Mean, covariance and quantities estimated outside the state; updated in place."""

    layout: Layout
    pose: Pose
    P: FloatArray  # (n, n) covariance of the error, in the order of Layout
    views: ViewErrors
    imus: LinkImus
    shared: SharedOffsets
    foot_height: FloatArray  # (1,) [m] of the lower foot above map's plane, as last seen

    def copy(self) -> "FilterState":
        """An independent copy."""
        return FilterState(
            layout=self.layout,
            pose=Pose(*_copies(self.pose)),
            P=self.P.copy(),
            views=ViewErrors(*_copies(self.views)),
            imus=LinkImus(*_copies(self.imus)),
            shared=SharedOffsets(*_copies(self.shared)),
            foot_height=self.foot_height.copy(),
        )


def _copies(group: Iterable[Any]) -> Iterator[Any]:
    return (np.array(each) for each in group)


def start_state(
    layout: Layout,
    sensors: int,
    tuning: "FilterTuning",
    slide_variance: FloatArray,
    position: FloatArray,
    R_map_links: FloatArray,
) -> FilterState:
    """A state at rest.

    Args:
        layout: Layout of the error state.
        sensors: Number of cameras.
        tuning: Contains the initial standard deviations.
        slide_variance: Of the sliding joints, (slides,) [m²].
        position: Of the root in map, (3,) [m].
        R_map_links: (links, 3, 3).
    """
    links, joints = layout.links, len(JOINTS)
    # Of a single camera, they cannot be distinguished from motion.
    has_depth_errors = float(sensors > 1)
    stddev = np.zeros(layout.body_size)
    stddev[:3] = tuning.start.position
    stddev[3 : layout.first_slide] = tuning.start.rotation
    stddev[layout.first_slide : layout.first_rate] = np.repeat(np.sqrt(slide_variance), 3)
    stddev[layout.first_rate : layout.first_rate + 3] = tuning.start.velocity
    stddev[layout.first_rate + 3 :] = tuning.start.rate
    return FilterState(
        layout=layout,
        pose=Pose(
            position=np.array(position, float),
            rotations=np.array(R_map_links, float, order="C"),
            slides=np.zeros((layout.slides, 3)),
            velocity=np.zeros(3),
            rates=np.zeros((links, 3)),
        ),
        P=np.diag(stddev**2),
        views=ViewErrors(
            delay=np.zeros(sensors),
            delay_sums=np.zeros((sensors, links, 2)),
            depth_error=np.zeros(sensors),
            depth_error_variance=np.full(sensors, has_depth_errors * tuning.start.depth_error**2),
            depth_error_power=np.full(sensors, has_depth_errors * tuning.start.depth_error**2),
            depth_noise=np.full(sensors, has_depth_errors * tuning.start.depth_noise**2),
            noise=np.ones(1),
            residual=np.full((sensors, joints), np.nan),
            offset=np.zeros((sensors, joints, 3)),
            offset_variance=np.full((sensors, joints), tuning.camera.offset_stddev**2),
            smoothed_nis=np.zeros((sensors, joints)),
            silent_s=np.full(sensors, SILENT_AT_START_S),
            apart=np.zeros((sensors, 3)),
        ),
        imus=LinkImus(
            R_sensor_link=np.tile(np.eye(3), (links, 1, 1)),
            heading=np.zeros(links),
            drift=np.zeros(links),
            drift_variance=np.full(links, tuning.imu.heading_drift**2),
            drift_covariance=np.zeros(links),
            column=np.full(links, NO_COLUMN, np.int64),
            is_used=np.zeros(links, np.bool_),
            noise=np.ones(links),
            link_residual=np.full((sensors, links, 3), np.nan),
            link_mean_residual=np.zeros((sensors, links, 3)),
            link_residual_sums=np.tile([0.0, LINK_RESIDUALS_AT_START], (links, 1)),
            contradicted_s=np.zeros(links),
        ),
        shared=SharedOffsets(
            offset=np.zeros((joints, 3)),
            column=np.full(joints, NO_COLUMN, np.int64),
            waist_mean=np.zeros(2),
            waist_s=np.zeros(1),
        ),
        foot_height=np.full(1, np.nan),
    )


def with_imu(
    state: FilterState, link: int, R_sensor_link: FloatArray, heading: float, covariance: FloatArray
) -> FilterState:
    """The state with the alignment of an IMU, added or replaced.

    Args:
        state: The state; arrays that keep their size are changed in place.
        link: The link that the IMU is worn on.
        R_sensor_link: Its sensor-to-segment rotation, (3, 3).
        heading: Of its world in map [rad].
        covariance: Of sensor-to-segment rotation and heading, (4, 4) [rad²].
    """
    column = int(state.imus.column[link])
    if column == NO_COLUMN:
        column = len(state.P)
        state.imus.column[link] = column
        state = _grown(state, IMU_STATES)
    forget_imu(state, link)
    own = slice(column, column + IMU_STATES)
    state.P[own, own] = covariance
    state.imus.R_sensor_link[link] = R_sensor_link
    state.imus.heading[link] = heading
    return state


def forget_imu(state: FilterState, link: int) -> None:
    """Forget what is known of the alignment of a link's IMU, if it has one; its drift remains."""
    column = int(state.imus.column[link])
    if column != NO_COLUMN:
        own = slice(column, column + IMU_STATES)
        state.P[own, :] = 0.0
        state.P[:, own] = 0.0
        state.imus.drift_covariance[link] = 0.0


def with_shared_offset(state: FilterState, joint: int, variance: float) -> FilterState:
    """The state with the shared offset of a limb's far joint; unchanged if it has it already.

    Args:
        state: The state; arrays that keep their size are changed in place.
        joint: The joint. Hips and shoulders are estimated otherwise, see ``shared_offsets``.
        variance: Prior variance of the offset [m²]; 0: none.
    """
    column = len(state.P)
    if variance == 0.0 or state.shared.column[joint] != NO_COLUMN:
        return state
    state.shared.column[joint] = column
    state = _grown(state, SHARED_OFFSET_STATES)
    for i in range(column, len(state.P)):
        state.P[i, i] = variance
    return state


def _grown(state: FilterState, columns: int) -> FilterState:
    """The state with more columns, of which the covariance is zero."""
    return state._replace(P=np.pad(state.P, (0, columns)))


@compiled_in_place
def another_camera_sends(state: FilterState, sensor: int) -> bool:
    """Whether another camera than this one sends frames."""
    for other in range(len(state.views.silent_s)):
        if other != sensor and state.views.silent_s[other] < CAMERA_TIMEOUT_S:
            return True
    return False


@compiled_in_place
def views_apart_variance(state: FilterState, axis: int) -> float:
    """Mean square distance [m²] of the cameras' views from the state, along one axis of map."""
    squared, cameras = 0.0, 0
    for sensor in range(len(state.views.silent_s)):
        if state.views.silent_s[sensor] < CAMERA_TIMEOUT_S:
            squared += state.views.apart[sensor, axis] ** 2
            cameras += 1
    return squared / max(cameras, 1)


@compiled_in_place
def inject_error(state: FilterState, error: FloatArray) -> None:
    """Add an error, (n,), to the mean; rotations through the exponential map."""
    pose, layout = state.pose, state.layout
    for axis in range(3):
        pose.position[axis] += error[axis]
        pose.velocity[axis] += error[layout.first_rate + axis]
        for slide in range(layout.slides):
            pose.slides[slide, axis] += error[layout.first_slide + 3 * slide + axis]
        for link in range(layout.links):
            pose.rates[link, axis] += error[rate_column(layout, link) + axis]
    for link in range(layout.links):
        at = rotation_column(link)
        rotate_left(error[at], error[at + 1], error[at + 2], pose.rotations[link])
        own = state.imus.column[link]
        if own != NO_COLUMN:
            rotate_right(error[own], error[own + 1], error[own + 2], state.imus.R_sensor_link[link])
            state.imus.heading[link] += error[own + 3]
    for joint in range(len(state.shared.offset)):
        own = state.shared.column[joint]
        if own != NO_COLUMN:
            for axis in range(3):
                state.shared.offset[joint, axis] += error[own + axis]
