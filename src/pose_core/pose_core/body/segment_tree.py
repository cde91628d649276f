r"""A body as rotations of its links in map: joint positions are linear in the rotations.

Every joint is the root's position plus offsets, each fixed in one link on the way to it:

.. math:: p_j = p_\mathrm{root} + \sum_l R_l\,(o_{jl} + s_{jl})

with s the slides of joints in their links. So the derivative with respect to a small rotation of
link l about map's axes is :math:`-[R_l o_{jl}]_\times`, whatever the structure of the tree.
"""

from functools import cached_property

import numpy as np

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.joints import JOINT_INDEX, JOINTS
from pose_core.kernels.axial_rotation import Hinges
from pose_core.kernels.joint_kinematics import BodyArrays


class SegmentTree:
    """The tree of a body model with a person's body measures.

    Args:
        model: The body model.
        shape: The person's body measures.
    """

    def __init__(self, model: BodyModel, shape: BodyShape) -> None:
        self.model = model
        self.parents = model.parents
        self.offsets = np.zeros((len(JOINTS), len(model.links), 3))
        """Offset of each link to each joint in the links' axes, (15, links, 3) [m]."""
        self.slides = np.zeros((len(JOINTS), len(model.sliding)))
        """(15, sliding joints): 1 if a joint moves with a sliding joint."""
        for row, joint in enumerate(JOINTS):
            self._walk(joint, row, shape)
        sliding_links = [model.link_index[model.joints[j].link] for j in model.sliding]
        self.sliding_links = np.array(sliding_links, int)
        """(sliding joints,): the link that each slides in."""

    def _walk(self, joint: str, row: int, shape: BodyShape) -> None:
        """Add up the offsets from a joint down to the root."""
        at: str | None = joint
        while at is not None:
            link = self.model.joints[at].link
            self.offsets[row, self.model.link_index[link]] += shape.offsets[JOINT_INDEX[at]]
            if at in self.model.sliding:
                self.slides[row, self.model.sliding.index(at)] = 1.0
            at = self.model.links[link].joint

    @cached_property
    def hinges(self) -> Hinges:
        """Elbows and knees."""
        links = list(self.model.links.values())
        hinges = np.array([i for i, link in enumerate(links) if len(link.dof) == 1], np.int64)
        return Hinges(
            parents=self.parents[hinges],
            links=hinges,
            signs=np.array([sum(links[i].dof[0].axis) for i in hinges], float),
        )

    @cached_property
    def spine(self) -> tuple[int, ...]:
        """Links above a joint of the spine: none of their joints has a direction."""
        limbs = {place.link for place in self.model.joints.values() if place.direction is not None}
        links = enumerate(self.model.links.values())
        return tuple(i for i, link in links if len(link.dof) == 3 and link.name not in limbs)

    @cached_property
    def turning(self) -> tuple[int, ...]:
        """Links whose axial rotation the cameras hardly observe: upper arms, thighs, the head."""
        links = enumerate(self.model.links.values())
        return tuple(i for i, link in links if len(link.dof) in (2, 3) and i not in self.spine)

    @cached_property
    def arrays(self) -> BodyArrays:
        """The tree as arrays for the kernels."""
        links = np.arange(len(self.parents))
        carriers = [
            np.flatnonzero(
                np.any(offsets != 0.0, axis=1) | np.isin(links, self.sliding_links[slides != 0.0])
            )
            for offsets, slides in zip(self.offsets, self.slides, strict=True)
        ]
        listed = np.zeros((len(carriers), max(map(len, carriers))), np.int64)
        for row, own in zip(listed, carriers, strict=True):
            row[: len(own)] = own
        return BodyArrays(
            parents=self.parents,
            offsets=self.offsets,
            sliding_links=self.sliding_links,
            slides=self.slides,
            carriers=listed,
            carrier_count=np.array([len(own) for own in carriers], np.int64),
        )


def without_side(link: str) -> str:
    """The kind of a link: its name without left or right."""
    return link.removeprefix("left_").removeprefix("right_")
