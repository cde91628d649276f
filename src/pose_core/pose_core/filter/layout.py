"""Layout of the default filter's error state."""

from typing import NamedTuple


class Layout(NamedTuple):
    """First columns of the parts of the error state, in their order.

    Position (3), link rotations (3 each), slides (3 each), velocity (3), angular velocities
    (3 each), then four for each IMU: mounting (3) and heading (1).
    """

    links: int
    slides: int
    slide: int  # after position and rotations
    velocity: int  # after the slides; position and rotations' rates in their order
    imus: int  # size of the error without any IMU


def make_layout(links: int, slides: int) -> Layout:
    """The layout of a body."""
    moving = 3 + 3 * links
    velocity = moving + 3 * slides
    return Layout(
        links=links,
        slides=slides,
        slide=moving,
        velocity=velocity,
        imus=velocity + moving,
    )
