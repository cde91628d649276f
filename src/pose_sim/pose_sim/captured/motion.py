"""Captured motion as input of the virtual devices of a session folder."""

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

from pose_core.joints import JOINT_INDEX, SIDES
from pose_sim.angles import AXIAL_ROTATIONS
from pose_sim.body import PROXIMAL_JOINTS, BodyPoses
from pose_sim.captured.clip import RATE, Clip
from pose_sim.captured.clips import heading, mid_hip
from pose_sim.motion import GRID_RATE, Motion

SMOOTHED = 1.2  # [-] frames, smoothing: IMUs measure the second derivative of rounded positions
ORIGINS = {
    "torso": "torso",
    "head": "neck",
    **{
        f"{side}_{segment}": f"{side}_{joint}"
        for side in SIDES
        for segment, joint in PROXIMAL_JOINTS.items()
    },
}
"""The proximal joint of each segment; for the pelvis midway between the hips."""


def motion_of(clip: Clip, duration: float, *, place: tuple[float, float], facing: float) -> Motion:
    """A clip's motion on the grid of the virtual devices, repeated forwards and backwards.

    Axial rotations of limbs, which the clip does not define, are NaN in the motion's angles.

    Args:
        clip: Motion of the whole body.
        duration: Duration [s].
        place: Position of the motion's middle, x and y [m] in map.
        facing: Initial heading [rad], about z from map's x.
    """
    rows = np.arange(int(np.ceil(duration * RATE)) + 1) % (2 * len(clip) - 2)
    rows = np.minimum(rows, 2 * len(clip) - 2 - rows)
    turn = Rotation.from_euler("z", facing - float(heading(clip.positions[0])))
    positions = clip.positions[rows] @ turn.as_matrix().T
    middle = positions[..., :2].reshape(-1, 2).mean(axis=0)
    positions[..., :2] += np.asarray(place) - middle
    positions = gaussian_filter1d(positions, SMOOTHED, axis=0, mode="nearest")
    frames = np.arange(len(rows)) / RATE
    times = np.arange(int(np.ceil(duration * GRID_RATE)) + 1) / GRID_RATE
    times = np.minimum(times, frames[-1])
    joints = make_interp_spline(frames, positions, k=5)(times)
    rotations = {
        name: Slerp(frames, turn * each[rows])(times).as_matrix()
        for name, each in clip.rotations.items()
    }
    origins = {
        name: joints[:, JOINT_INDEX[ORIGINS[name]]] if name in ORIGINS else mid_hip(joints)
        for name in rotations
    }
    pose = BodyPoses(
        joints=joints, rotations=rotations, origins=origins, contacts=np.zeros((len(times), 4, 3))
    )
    unknown = np.full(len(times), np.nan)
    return Motion(times=times, angles=dict.fromkeys(AXIAL_ROTATIONS, unknown), pose=pose)
