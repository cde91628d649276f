r"""A body as rotations of its links in the world: joint positions are linear in them.

Every joint is the root's position plus offsets, each fixed in one link on the way to it:

.. math:: p_j = p_\mathrm{root} + \sum_l R_l\,(o_{jl} + s_{jl})

with s the slide of the shoulders on the clavicles. So the derivative by a small turn of link l
about the world's axes is simply :math:`-[R_l o_{jl}]_\times`, whatever hangs on what.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pose_common.joints import JOINT_INDEX, JOINTS
from pose_fusion.body.model import BodyModel
from pose_fusion.body.shape import BodyShape
from pose_fusion.streams.samples import FloatArray


@dataclass(frozen=True, kw_only=True)
class Hinge:
    """A link that only bends about its parent's lateral axis."""

    parent: int  # index of the link
    link: int
    sign: float  # of the rotation about +y that counts as flexion


class SegmentTree:
    """The tree of a body model with a person's measures.

    Args:
        model: The body model.
        shape: The person's measures.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self.model = model
        names = model.link_names
        index = {name: i for i, name in enumerate(names)}
        links = list(model.links.values())
        self.parents = np.array([-1 if k.parent is None else index[k.parent] for k in links])
        self.offsets = np.zeros((len(JOINTS), len(names), 3))
        """(15, links, 3) [m] in the links' axes: what each link adds to each joint."""
        self.slides = np.zeros((len(JOINTS), len(model.sliding)))
        """(15, sliding joints): 1 where a joint goes along with a sliding joint."""
        for joint in JOINTS:
            self._walk(joint, JOINT_INDEX[joint], shape, index)
        self.sliding_links = np.array([index[model.joints[j].link] for j in model.sliding], int)
        """(sliding joints,): the link that each slides in."""

    def _walk(self, joint: str, row: int, shape: BodyShape, index: dict[str, int]) -> None:
        """Add up the offsets from a joint down to the root."""
        at: str | None = joint
        while at is not None:
            link = self.model.joints[at].link
            self.offsets[row, index[link]] += shape.offsets[JOINT_INDEX[at]]
            if at in self.model.sliding:
                self.slides[row, self.model.sliding.index(at)] = 1.0
            at = self.model.links[link].joint

    @cached_property
    def hinges(self) -> tuple[Hinge, ...]:
        """Elbows and knees."""
        return tuple(
            Hinge(parent=int(self.parents[i]), link=i, sign=float(sum(link.dof[0].axis)))
            for i, link in enumerate(self.model.links.values())
            if len(link.dof) == 1
        )

    @cached_property
    def spine(self) -> tuple[int, ...]:
        """Links between which the spine bends: those that a spine joint bears."""
        return tuple(
            i
            for i, link in enumerate(self.model.links.values())
            if len(link.dof) == 3 and self._is_measured(link.name)
        )

    @cached_property
    def turning(self) -> tuple[int, ...]:
        """Links whose turn about their own axis the cameras hardly see: upper limbs, the head."""
        return tuple(
            i
            for i, link in enumerate(self.model.links.values())
            if len(link.dof) in (2, 3) and i not in self.spine
        )

    def _is_measured(self, link: str) -> bool:
        return all(p.direction is None for p in self.model.joints.values() if p.link == link)

    def levers(self, rotations: FloatArray, slides: FloatArray) -> FloatArray:
        """What each link adds to each joint, in map.

        Args:
            rotations: ``R_map_link``, shape (links, 3, 3).
            slides: Of the sliding joints, in their links' axes, shape (sliding joints, 3) [m].

        Returns:
            Shape (15, links, 3) [m].
        """
        levers = np.einsum("lab,jlb->jla", rotations, self.offsets)
        for column, link in enumerate(self.sliding_links):
            levers[:, link] += np.outer(self.slides[:, column], rotations[link] @ slides[column])
        return levers


def flexion(R_parent_link: FloatArray, sign: float) -> float:
    """A hinge's angle [rad], negative when it is bent the wrong way."""
    R = R_parent_link
    return sign * float(np.arctan2(R[0, 2] - R[2, 0], R[0, 0] + R[2, 2]))


def twist(R_parent_link: FloatArray) -> tuple[float, float]:
    """A link's turn about its own z axis, by swing and twist.

    Args:
        R_parent_link: Shape (3, 3).

    Returns:
        The twist [rad], and how well it is defined, from 0 (swung by half a turn) to 1.
    """
    R = R_parent_link
    w = 0.5 * np.sqrt(max(0.0, 1.0 + R[0, 0] + R[1, 1] + R[2, 2]))
    z = (R[1, 0] - R[0, 1]) / (4.0 * w) if w > 1e-6 else 1.0
    return 2.0 * float(np.arctan2(z, w)), float(min(1.0, w * w + z * z))


def without_side(link: str) -> str:
    """The kind of a link: its name without left or right."""
    return link.removeprefix("left_").removeprefix("right_")
