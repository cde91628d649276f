"""How people move: the power of the white accelerations behind a segment filter's rates."""

from dataclasses import dataclass, field

import numpy as np

from pose_core.body.segment_tree import SegmentTree, without_side
from pose_core.streams.samples import FloatArray

FRAME_PERIOD_S = 1.0 / 30.0  # for which accelerations are meant as white


@dataclass(frozen=True, kw_only=True)
class MotionPrior:
    """How people move; docs/algorithm.md says where each number comes from."""

    root_acceleration: float = 6.6  # [m/s²]
    acceleration: dict[str, float] = field(  # [rad/s²] by link, without its side
        default_factory=lambda: {
            "pelvis": 12.0,
            "trunk": 20.0,
            "head": 22.0,
            "upper_arm": 30.0,
            "forearm": 12.0,
            "thigh": 19.0,
            "shank": 28.0,
        }
    )
    carried: dict[str, float] = field(  # [-] share of the parent's acceleration that a link takes
        default_factory=lambda: {
            "pelvis": 0.0,
            "trunk": 0.9,
            "head": 0.0,
            "upper_arm": 0.1,
            "forearm": 0.9,
            "thigh": 0.3,
            "shank": 0.13,
        }
    )
    rate_memory: float = 0.12  # [s] in which rates die away
    slide_stddev: float = 0.02  # [m] of the joints that slide
    slide_memory: float = 0.5  # [s]
    start_position_stddev: float = 0.03  # [m]
    start_angle_stddev: float = 0.15  # [rad]
    start_velocity_stddev: float = 0.2  # [m/s]
    start_rate_stddev: float = 0.5  # [rad/s]


def acceleration_power(motion: MotionPrior, tree: SegmentTree) -> FloatArray:
    """Power of the white accelerations of the root and of all links, (3 + 3 links) squared.

    A link takes a share of its parent's acceleration along, and that of its parent's parent.
    """
    links = len(tree.parents)
    kinds = [without_side(name) for name in tree.model.link_names]
    own = np.array([motion.acceleration[kind] for kind in kinds])
    path = np.eye(links)
    for link, parent in enumerate(tree.parents):
        if parent >= 0:
            path[link] += motion.carried[kinds[link]] * path[parent]
    power = np.zeros((3 + 3 * links, 3 + 3 * links))
    power[:3, :3] = motion.root_acceleration**2 * np.eye(3)
    power[3:, 3:] = np.kron((path * own**2) @ path.T, np.eye(3))
    return power * FRAME_PERIOD_S
