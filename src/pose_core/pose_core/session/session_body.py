"""Body measures in a session's calibration."""

from dataclasses import dataclass

from pose_core.body.shape import BodyShape


@dataclass(frozen=True, kw_only=True)
class SessionBody:
    """A person's body measures, and the body model that they refer to."""

    model: str
    shape: BodyShape
