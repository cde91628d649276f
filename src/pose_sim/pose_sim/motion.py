"""A simulated motion: every joint and segment as a smooth function of time."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from pose_core.arrays import FloatArray, without_sign_changes
from pose_core.joints import SIDES
from pose_sim.body import BODY_ANGLES, BodyPoses
from pose_sim.rotations import rotate
from pose_sim.timeline import AngleTimeline, minimum_jerk

GRID_RATE = 200.0  # [Hz] of the splines' nodes
LOAD_TRANSFER = 0.03  # [s]
SWAY_HARMONICS = 4
SWAY_BAND = (0.08, 0.7)  # [Hz]


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A body's motion on a regular grid of times, interpolated by splines.

    Attributes:
        times: Grid [s] from zero on, shape (n,).
        angles: The body's angles [rad] by name, shape (n,) each.
        pose: Joints, segments and contacts on the grid, in ``map``.
    """

    times: FloatArray
    angles: Mapping[str, FloatArray]
    pose: BodyPoses

    @cached_property
    def joints_at(self) -> CubicSpline:
        """Joint positions [m] in ``map`` at times [s], shape (m,) to (m, 15, 3)."""
        return CubicSpline(self.times, self.pose.joints)

    def segment(self, segment: str, offset: FloatArray) -> "SegmentPath":
        """The path of a segment and of a point fixed to it (``offset`` [m] in its frame)."""
        rotations = self.pose.rotations[segment]
        turned = rotate(rotations, np.broadcast_to(offset, (len(rotations), 3)))
        return SegmentPath(
            # Fifth order, for a smooth acceleration of the point.
            position=make_interp_spline(self.times, self.pose.origins[segment] + turned, k=5),
            quaternion=CubicSpline(
                self.times, without_sign_changes(Rotation.from_matrix(rotations).as_quat())
            ),
        )


@dataclass(frozen=True, kw_only=True)
class SegmentPath:
    """Pose and motion of a segment's frame at any time."""

    position: "make_interp_spline"  # [m] of the point in map
    quaternion: CubicSpline  # R_map_segment, not normalised between the grid's times

    def rotation(self, times: FloatArray) -> Rotation:
        """``R_map_segment`` at times [s]."""
        return Rotation.from_quat(self.quaternion(times))

    def angular_velocity(self, times: FloatArray) -> FloatArray:
        """Angular velocity [rad/s] in the segment's frame, shape (m, 3)."""
        q = self.quaternion(times)
        norm2 = np.sum(q * q, axis=1, keepdims=True)
        rate = self.quaternion(times, 1)
        vector, scalar = q[:, :3], q[:, 3:]
        vector_rate, scalar_rate = rate[:, :3], rate[:, 3:]
        # omega = 2 Im(q* q'), for a quaternion of any norm
        product = scalar * vector_rate - vector * scalar_rate - np.cross(vector, vector_rate)
        return 2.0 * product / norm2

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Acceleration of the point [m/s^2] in ``map``, shape (m, 3)."""
        return self.position(times, 2)


def perform(
    timeline: AngleTimeline,
    duration: float,
    *,
    place: tuple[float, float],
    heading: float,
    rng: np.random.Generator,
    still: float,
) -> Motion:
    """Simulate the motion of a timeline's body by its joint angles.

    The lowest points of the feet carry the load: they are at the floor's height and do not slide.

    Args:
        timeline: The joint angles.
        duration: Duration of the motion [s].
        place: Initial position of the middle of the hips, x and y [m] in ``map``.
        heading: Initial heading [rad], about z from ``map``'s x.
        rng: Random generator of the sway.
        still: Duration without sway at the start [s].
    """
    body = timeline.body
    times = np.arange(int(np.ceil(duration * GRID_RATE)) + 1) / GRID_RATE
    channels = timeline.evaluate(times)
    clearance = channels["clearance"]
    angles = {name: channels[name] for name in BODY_ANGLES}
    angles["pelvis_yaw"] += heading
    angles["pelvis_tilt"] += timeline.lean
    _add_sway(angles, times, still, timeline.variation.sway, rng)
    _move_clavicles(angles)
    pose = body.pose(angles)
    lowest, shares = body.contact_height(pose.contacts)
    root = np.empty((len(times), 3))
    root[:, 2] = clearance - lowest
    # Loaded points do not move along the floor; in flight, there is no sideways force. The load
    # moves smoothly between the feet, which avoids jumps of the hips' velocity.
    shares = gaussian_filter1d(shares, LOAD_TRANSFER * GRID_RATE, axis=0, mode="nearest")
    carried = np.einsum("nc,nci->ni", shares, np.gradient(pose.contacts[..., :2], times, axis=0))
    carried *= np.exp(-((clearance / 0.02) ** 2))[:, None]
    steps = 0.5 * (carried[1:] + carried[:-1]) / GRID_RATE
    root[:, :2] = place - np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))
    pose = replace(
        pose,
        joints=pose.joints + root[:, None, :],
        origins={segment: origin + root for segment, origin in pose.origins.items()},
        contacts=pose.contacts + root[:, None, :],
    )
    return Motion(times=times, angles=angles, pose=pose)


def _move_clavicles(angles: dict[str, FloatArray]) -> None:
    """Move the clavicles with the arms: up by 22 deg overhead, forward by 12 deg in reaching."""
    for side in SIDES:
        flexion = angles[f"{side}_shoulder_flexion"]
        abduction = angles[f"{side}_shoulder_abduction"]
        raised = 0.5 * (1.0 - np.cos(flexion) * np.cos(abduction))
        forward = np.sin(flexion) * np.cos(abduction)
        angles[f"{side}_clavicle_elevation"] += np.radians(22.0) * raised
        angles[f"{side}_clavicle_protraction"] += np.radians(12.0) * forward


SWAY_GAINS: dict[str, float] = {
    "lumbar_flexion": 0.7,
    "lumbar_lateral_bending": 0.5,
    "lumbar_rotation": 0.7,
    "thoracic_flexion": 0.7,
    "thoracic_rotation": 0.7,
    "neck_flexion": 2.0,
    "neck_lateral_bending": 1.0,
    "neck_rotation": 3.0,
    **{
        f"{side}_{angle}": gain
        for side in SIDES
        for angle, gain in {
            "shoulder_flexion": 1.5,
            "shoulder_abduction": 1.0,
            "shoulder_rotation": 3.0,
            "elbow_flexion": 2.0,
            "forearm_rotation": 4.0,
        }.items()
    },
}
"""Amplitude of the postural sway, in units of :attr:`Variation.sway`."""


def _add_sway(
    angles: dict[str, FloatArray],
    times: FloatArray,
    still: float,
    sway: float,
    rng: np.random.Generator,
) -> None:
    envelope = minimum_jerk((times - still) / 1.5)
    for name, gain in {**SWAY_GAINS, "shift": 0.6}.items():
        frequencies = rng.uniform(*SWAY_BAND, SWAY_HARMONICS)
        phases = rng.uniform(0.0, 2.0 * np.pi, SWAY_HARMONICS)
        waves = np.sin(2.0 * np.pi * frequencies * times[:, None] + phases).sum(axis=1)
        size = np.radians(sway * gain) * np.sqrt(2.0 / SWAY_HARMONICS)
        unrest = size * envelope * waves
        if name == "shift":  # weight shift between the feet: both legs lean equally
            angles["left_hip_abduction"] += unrest
            angles["right_hip_abduction"] -= unrest
        else:
            angles[name] += unrest
