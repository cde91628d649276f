"""Frames of a body's URDF: names and poses."""

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.model import BodyModel
from pose_core.body.urdf import chain_frames, end_joints, joint_frame, link_frame
from pose_core.joints import JOINT_INDEX
from pose_core.kernels.compiling import type_specialised
from pose_core.kernels.link_frames import AuxiliaryFrames, compute_frame_poses_batch


class BodyFrames:
    """All frames: the links, then those inside a joint's chain, then the ends of limbs.

    RViz wants a transform for each.

    Args:
        model: The body model.
        body_id: The person's id.
    """

    def __init__(self, model: BodyModel, body_id: str) -> None:
        self.names = [link_frame(link, body_id) for link in model.links.values()]
        between: list[tuple[int, int, tuple[float, float, float], int]] = []
        for row, link in enumerate(model.links.values()):
            frames = chain_frames(link, body_id)
            at = row
            for index in range(len(frames) - 2, -1, -1):
                turned = link.dof[index + 1]
                between.append((at, model.dof_index[turned.name], turned.axis, 0))
                at = len(self.names)
                self.names.append(frames[index])
        for joint in end_joints(model):
            link_row = model.link_index[model.joints[joint].link]
            between.append((link_row, -1, (0.0, 0.0, 0.0), JOINT_INDEX[joint]))
            self.names.append(joint_frame(model, joint, body_id))
        self._place_all = type_specialised(compute_frame_poses_batch)
        source, dof, axis, joints = zip(*between, strict=True)
        self._between = AuxiliaryFrames(
            source=np.array(source, np.int64),
            dof=np.array(dof, np.int64),
            axis=np.array(axis, float),
            joint=np.array(joints, np.int64),
        )

    def places(self, T_map_link: FloatArray, angles: FloatArray, joints: FloatArray) -> FloatArray:
        """Compute the frames' poses: the body's in map, all others relative to the body.

        Args:
            T_map_link: Transforms at n instants, shape (n, links, 4, 4).
            angles: The degrees of freedom, shape (n, d).
            joints: In map, shape (n, 15, 3) [m].

        Returns:
            Shape (n, frames, 7): x, y, z [m]; quaternion x, y, z, w.
        """
        places = np.empty((len(joints), len(self.names), 7))
        self._place_all(T_map_link, angles, joints, self._between, places)
        return places
