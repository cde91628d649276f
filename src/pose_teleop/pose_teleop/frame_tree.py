"""A person's frames from the fusion's ``/tf``: the body in map, all others in the body."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.api import FloatArray


@dataclass(frozen=True, kw_only=True)
class BodyPlaces:
    """Frames of one instant, n of them.

    Attributes:
        index: Row by name, without the person's id.
        position: [m] (n, 3) in the requested frame.
        rotation: n rotations into that frame.
    """

    index: Mapping[str, int]
    position: FloatArray
    rotation: Rotation


def body_places(
    names: Sequence[str], position: FloatArray, xyzw: FloatArray, subject: str, in_body: bool
) -> BodyPlaces:
    """Compute the frames of one person.

    Args:
        names: Names of n frames, the body's first.
        position: [m] (n, 3): the body in map, all others in the body.
        xyzw: Quaternions (n, 4) in the same frames.
        subject: The person's id, with which all names end.
        in_body: Whether the result is in the person's own frame; otherwise in map.
    """
    rotation = Rotation.from_quat(xyzw)
    body, origin = (Rotation.identity(), np.zeros(3)) if in_body else (rotation[0], position[0])
    return BodyPlaces(
        index={name.removesuffix(f"_{subject}"): row for row, name in enumerate(names)},
        position=np.vstack([origin, body.apply(position[1:]) + origin]),
        rotation=Rotation.concatenate([body, body * rotation[1:]]),
    )
