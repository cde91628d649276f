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
        links = model.link_names
        self.names = [link_frame(link, body_id) for link in model.links.values()]
        source: list[int] = []
        dof: list[int] = []
        axis: list[FloatArray] = []
        joints: list[int] = []
        for row, link in enumerate(model.links.values()):
            frames = chain_frames(link, body_id)
            at = row
            for index in range(len(frames) - 2, -1, -1):
                turned = link.dof[index + 1]
                source.append(at)
                dof.append(model.dof_index[turned.name])
                axis.append(np.array(turned.axis, float))
                joints.append(0)
                at = len(self.names)
                self.names.append(frames[index])
        for joint in end_joints(model):
            source.append(links.index(model.joints[joint].link))
            dof.append(-1)
            axis.append(np.zeros(3))
            joints.append(JOINT_INDEX[joint])
            self.names.append(joint_frame(model, joint, body_id))
        self._place_all = type_specialised(compute_frame_poses_batch)
        self._between = AuxiliaryFrames(
            source=np.array(source, np.int64),
            dof=np.array(dof, np.int64),
            axis=np.array(axis).reshape(-1, 3),
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
