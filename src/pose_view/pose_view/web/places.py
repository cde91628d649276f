"""Order, titles and colours of the bodies."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class BodyPanel:
    """Title and colours of one body."""

    body: str  # its id
    title: str
    skin: tuple[int, int, int]  # of its surface, 0 to 255
    line: str  # of its curves, for CSS
    wears_imus: bool = True


PEOPLE = (
    ((214, 176, 190), "#a34a72"),
    ((200, 200, 160), "#7d7a1f"),
    ((186, 178, 214), "#6b55a8"),
    ((160, 200, 200), "#2a7f86"),
    ((206, 190, 176), "#7a5536"),
)
"""Colours of people besides the subject, used in turn."""


def place_of(body: str) -> BodyPanel:
    """Title and colours by the body's id, whose suffix may name one kind of sensor."""
    name, _, kind = body.rpartition("_")
    if kind == "kinect":
        return BodyPanel(
            body=body, title="Kinects alone", skin=(146, 170, 198), line="#3f73ab", wears_imus=False
        )
    if kind == "imu":
        return BodyPanel(body=body, title="IMUs alone", skin=(156, 190, 164), line="#2f8f5b")
    if name == "person" and kind.isdecimal():
        skin, line = PEOPLE[int(kind) % len(PEOPLE)]
        return BodyPanel(body=body, title=f"Person {kind}", skin=skin, line=line, wears_imus=False)
    return BodyPanel(body=body, title="Fused", skin=(224, 198, 172), line="#c2541b")
