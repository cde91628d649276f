"""What is known of a posture before any sensor: hinges, limits, how far a spine and limbs turn.

Each is a soft measurement of the links' relative rotation. They are weak, and repeated with every
frame: their variances are those of one look, multiplied by the frames that count as one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from pose_fusion.body.kinematics import skew
from pose_fusion.body.segment_tree import SegmentTree, flexion, twist, without_side
from pose_fusion.filters.segment_state import Layout
from pose_fusion.streams.samples import FloatArray

LEAST_DEFINED = 1e-3  # [-] of a twist


@dataclass(frozen=True, kw_only=True)
class PosturePrior:
    """Numbers of the prior; docs/algorithm.md says where each comes from."""

    hinge_stddev: float = 0.21  # [rad] of elbows and knees out of their plane
    hinge_frames: float = 3.0  # [-] that count as one look
    limit_stddev: float = 0.0335  # [rad] of a hinge bent the wrong way
    twist_stddev: Mapping[str, float] = field(  # [rad] of a link about itself, by its kind
        default_factory=lambda: {"upper_arm": 0.5, "thigh": 0.5, "head": 0.26}
    )
    twist_frames: float = 49.0
    waist_stddev: tuple[float, float, float] = (0.26, 0.44, 0.44)  # [rad] about x, y, z
    waist_frames: float = 121.0


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
