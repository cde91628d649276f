"""Layout of the default filter's error state."""

from typing import NamedTuple

from pose_core.kernels.compiling import compiled_in_place


class Layout(NamedTuple):
    """First columns of the parts of the error state, in their order.

    Position (3), link rotations (3 each), slides (3 each), velocity (3), angular velocities
    (3 each), then, for each IMU, sensor-to-segment rotation (3), heading (1) and, on a limb, the
    shared offset of its far joint (3).
    """

    links: int
    slides: int
    first_slide: int  # after position and rotations
    first_rate: int  # after the slides; velocity and angular velocities
    body_size: int  # size of the error without any IMU


def make_layout(links: int, slides: int) -> Layout:
    """The layout of a body."""
    moving = rotation_column(links)
    return Layout(
        links=links,
        slides=slides,
        first_slide=moving,
        first_rate=moving + 3 * slides,
        body_size=2 * moving + 3 * slides,
    )


@compiled_in_place
def rotation_column(link: int) -> int:
    """First of the three columns of a link's rotation."""
    return 3 + 3 * link


@compiled_in_place
def rate_column(layout: Layout, link: int) -> int:
    """First of the three columns of a link's angular velocity."""
    return layout.first_rate + 3 + 3 * link
