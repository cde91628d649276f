"""A person's frames as published by the fusion."""

import numpy as np
from synthetic_body import body_offsets

from pose_core.api import BodyFrames, ForwardKinematics, load_body_model
from pose_core.joints import JOINT_INDEX

MODEL = load_body_model("default")


def sent_frames(angles=None, place=(2.0, 0.5, 0.9), turn=0.0):
    """Names, positions and quaternions as on /tf; and the 15 joints in map."""
    state = np.zeros(MODEL.size)
    state[:3], state[5] = place, turn
    for name, angle in (angles or {}).items():
        state[MODEL.dof_index[name]] = angle
    pose = ForwardKinematics(MODEL, body_offsets()).pose(state[None])
    T_map_link = np.tile(np.eye(4), (1, len(MODEL.links), 1, 1))
    T_map_link[:, :, :3, :3] = pose.rotations
    for row, link in enumerate(MODEL.links.values()):
        at = state[:3] if link.joint is None else pose.positions[0, JOINT_INDEX[link.joint]]
        T_map_link[0, row, :3, 3] = at
    frames = BodyFrames(MODEL, "subject")
    (found,) = frames.places(T_map_link, state[None], pose.positions)
    return frames.names, found[:, :3], found[:, 3:], pose.positions[0]
