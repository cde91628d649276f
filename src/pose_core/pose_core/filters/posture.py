"""What is known of a posture before any sensor: hinges, limits, how far a spine and limbs turn.

Each is a soft measurement of the links' relative rotation. They are weak, and repeated with every
frame: their variances are those of one look, multiplied by the frames that count as one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.kernels.posture import PostureNumbers


@dataclass(frozen=True, kw_only=True)
class PosturePrior:
    """Numbers of the prior; docs/algorithm.md says where each comes from."""

    hinge_stddev: float = 0.21  # [rad] of elbows and knees out of their plane
    hinge_frames: float = 3.0  # [-] that count as one look
    limit_stddev: float = 0.0335  # [rad] of a hinge bent the wrong way
    twist_stddev: Mapping[str, float] = field(  # [rad] of a link about itself, by its kind
        default_factory=lambda: {"upper_arm": 0.5, "thigh": 0.2, "head": 0.26}
    )
    twist_frames: float = 49.0
    waist_stddev: tuple[float, float, float] = (0.4, 0.4, 0.4)  # [rad] about x, y, z
    waist_frames: float = 30.0


def posture_numbers(prior: PosturePrior, tree: SegmentTree) -> PostureNumbers:
    """A prior's soft measurements of one body."""
    names = tree.model.link_names
    twist_stddev = np.array([prior.twist_stddev[without_side(names[k])] for k in tree.turning])
    turning, spine = np.array(tree.turning, np.int64), np.array(tree.spine, np.int64)
    hinge_parents, hinge_links, hinge_signs = tree.hinge_arrays
    return PostureNumbers(
        hinge_parents=hinge_parents,
        hinge_links=hinge_links,
        hinge_signs=hinge_signs,
        hinge_variance=float(prior.hinge_stddev**2 * prior.hinge_frames),
        limit_variance=float(prior.limit_stddev**2),
        twist_parents=tree.parents[turning],
        twist_links=turning,
        twist_variance=twist_stddev**2 * prior.twist_frames,
        spine_parents=tree.parents[spine],
        spine_links=spine,
        spine_variance=np.square(prior.waist_stddev) * prior.waist_frames,
    )
