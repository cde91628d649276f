"""Where the bodies stand, what they are called and which colour they have."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Place:
    """One body's."""

    body: str  # its id
    title: str
    skin: tuple[int, int, int]  # of its surface, 0 to 255
    line: str  # of its curves, for CSS
    wears_imus: bool = True


def places_of(bodies: Sequence[str]) -> tuple[Place, ...]:
    """From left to right, by the bodies' ids: those that end in a kind of sensor use it alone."""
    places = []
    for body in bodies:
        kind = body.rpartition("_")[2]
        if kind == "kinect":
            place = Place(
                body=body,
                title="Kinects alone",
                skin=(146, 170, 198),
                line="#3f73ab",
                wears_imus=False,
            )
        elif kind == "imu":
            place = Place(body=body, title="IMUs alone", skin=(156, 190, 164), line="#2f8f5b")
        else:
            place = Place(body=body, title="Fused", skin=(224, 198, 172), line="#c2541b")
        places.append(place)
    return tuple(places)
