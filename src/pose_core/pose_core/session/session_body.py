"""A person's measures as a session knows them."""

from dataclasses import dataclass

from pose_core.body.shape import BodyShape


@dataclass(frozen=True, kw_only=True)
class SessionBody:
    """A person's measures, and the body model whose links they are given in."""

    model: str
    shape: BodyShape
