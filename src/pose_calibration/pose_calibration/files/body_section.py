"""The section ``body`` of a session's file: the person's body measures.

.. code-block:: yaml

    body:
      body_model: default
      bone_lengths: {left_knee: 0.431, ...}  # [m] from the parent joint, for information
      offsets: {left_knee: [0.0, 0.0, -0.431], ...}  # [m] in the axes of the joint's link
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pose_calibration.files.file_values import read_mapping, rounded_list
from pose_core.api import BodyModel, BodyShape, FloatArray, SessionBody, load_body_model
from pose_core.body.shape import LONGEST_BONE
from pose_core.errors import InputError
from pose_core.finite_numbers import finite_numbers
from pose_core.joints import JOINT_INDEX, JOINTS


def body_document(body: SessionBody) -> dict[str, Any]:
    """Body measures as plain values."""
    lengths = body.shape.bone_lengths()
    return {
        "body_model": body.model,
        "bone_lengths": {name: round(length, 4) for name, length in lengths.items()},
        "offsets": {
            name: rounded_list(body.shape.offsets[index], 5) for name, index in JOINT_INDEX.items()
        },
    }


def read_body(path: Path, section: Any) -> SessionBody | None:
    """Read the body measures of a session's document; None if it has no such section.

    Raises:
        InputError: If the section is invalid.
    """
    if section is None:
        return None
    section = read_mapping(f"{path}: 'body'", section)
    model = _model(path, section.get("body_model"))
    offsets = section.get("offsets")
    if not isinstance(offsets, Mapping) or set(offsets) != set(JOINTS):
        found = sorted(map(str, offsets)) if isinstance(offsets, Mapping) else offsets
        raise InputError(
            f"{path}: body/offsets has {found!r}, expected all of {', '.join(JOINTS)}: "
            "calibrate again, or remove the section to have the body measured"
        )
    shape = np.array([_offset(path, name, offsets[name]) for name in JOINTS])
    return SessionBody(model=model.name, shape=BodyShape(offsets=shape))


def _model(path: Path, name: Any) -> BodyModel:
    try:
        return load_body_model(str(name))
    except InputError as error:
        raise InputError(f"{path}: body/body_model is {name!r}: {error}") from error


def _offset(path: Path, name: str, value: Any) -> FloatArray:
    offset = finite_numbers(value, 3)
    if offset is None or not (np.abs(offset) < LONGEST_BONE).all():
        raise InputError(
            f"{path}: body/offsets/{name} is {value!r}, expected three numbers within "
            f"±{LONGEST_BONE:g} m"
        )
    return offset
