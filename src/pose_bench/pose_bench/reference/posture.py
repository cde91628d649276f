"""What is known of a posture beforehand, in plain numpy: see ``pose_core.filters.posture``."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.body.kinematics import skew
from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.filters.posture import PosturePrior
from pose_core.filters.segment_state import Layout
from pose_core.streams.samples import FloatArray

LEAST_DEFINED = 1e-3  # [-] of a twist


@dataclass(frozen=True, kw_only=True)
class Looks:
    """Linear measurements of the pose's error: C e = residual ± √variance."""

    C: FloatArray  # (m, pose size)
    residual: FloatArray  # (m,)
    variance: FloatArray  # (m,)


class Posture:
    """Looks at a pose for what the prior says of it.

    Args:
        tree: The body.
        layout: Of the error.
        prior: The numbers.
    """

    def __init__(self, tree: SegmentTree, layout: Layout, prior: PosturePrior) -> None:
        self._tree = tree
        self._layout = layout
        self._prior = prior
        names = tree.model.link_names
        self._twist_variance = {
            link: prior.twist_stddev[without_side(names[link])] ** 2 * prior.twist_frames
            for link in tree.turning
        }

    def look(self, rotations: FloatArray) -> Looks:
        """All soft measurements at a pose, given its ``R_map_link``, shape (links, 3, 3)."""
        rows = [*self._hinges(rotations), *self._twists(rotations), *self._waist(rotations)]
        C = np.zeros((len(rows), self._layout.pose_size))
        for row, (parent, link, axis, _, _) in zip(C, rows, strict=True):
            row[self._layout.rotation(link)] = axis
            row[self._layout.rotation(parent)] = -axis
        return Looks(
            C=C,
            residual=np.array([row[3] for row in rows]),
            variance=np.array([row[4] for row in rows]),
        )

    def _hinges(self, rotations: FloatArray) -> list["_Row"]:
        rows: list[_Row] = []
        p = self._prior
        for hinge in self._tree.hinges:
            R_parent, R_link = rotations[hinge.parent], rotations[hinge.link]
            lateral = R_parent.T @ R_link[:, 1]
            J = -R_parent.T @ skew(R_link[:, 1])
            variance = p.hinge_stddev**2 * p.hinge_frames
            rows.extend(
                (hinge.parent, hinge.link, J[axis], -lateral[axis], variance) for axis in (0, 2)
            )
            angle = flexion(R_parent.T @ R_link, hinge.sign)
            if angle < 0.0:
                axis_map = hinge.sign * R_parent[:, 1]
                rows.append((hinge.parent, hinge.link, axis_map, -angle, p.limit_stddev**2))
        return rows

    def _twists(self, rotations: FloatArray) -> list["_Row"]:
        rows: list[_Row] = []
        for link, variance in self._twist_variance.items():
            parent = int(self._tree.parents[link])
            angle, defined = twist(rotations[parent].T @ rotations[link])
            widened = variance / max(defined, LEAST_DEFINED) ** 2
            rows.append((parent, link, rotations[link][:, 2], -angle, widened))
        return rows

    def _waist(self, rotations: FloatArray) -> list["_Row"]:
        rows: list[_Row] = []
        variance = np.square(self._prior.waist_stddev) * self._prior.waist_frames
        for link in self._tree.spine:
            parent = int(self._tree.parents[link])
            R_parent = rotations[parent]
            vector = Rotation.from_matrix(R_parent.T @ rotations[link]).as_rotvec()
            rows.extend(
                (parent, link, R_parent[:, axis], -vector[axis], variance[axis])
                for axis in range(3)
            )
        return rows


_Row = tuple[int, int, FloatArray, float, float]
"""Parent, link, derivative by their relative turn in map, residual, variance."""


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
