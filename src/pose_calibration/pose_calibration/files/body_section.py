"""The section ``body`` of a session's file: the person's body measures.

.. code-block:: yaml

    body:
      body_model: default
      bone_lengths: {left_knee: 0.431, ...}  # [m] from the parent joint, for information
      offsets: {left_knee: [0.0, 0.0, -0.431], ...}  # [m] in the axes of the joint's link
"""

from pathlib import Path
from typing import Any

from pose_calibration.files.file_values import read_mapping
from pose_core.api import SessionBody, load_body_model
from pose_core.body.shape import offsets_document, shape_of_offsets
from pose_core.errors import InputError


def body_document(body: SessionBody) -> dict[str, Any]:
    """Body measures as plain values."""
    lengths = body.shape.bone_lengths()
    return {
        "body_model": body.model,
        "bone_lengths": {name: round(length, 4) for name, length in lengths.items()},
        "offsets": offsets_document(body.shape),
    }


def read_body(path: Path, section: Any) -> SessionBody | None:
    """Read the body measures of a session's document; None if it has no such section.

    Raises:
        InputError: If the section is invalid.
    """
    if section is None:
        return None
    section = read_mapping(f"{path}: 'body'", section)
    name = section.get("body_model")
    try:
        model = load_body_model(str(name))
    except InputError as error:
        raise InputError(f"{path}: body/body_model is {name!r}: {error}") from error
    shape = shape_of_offsets(f"{path}: body/offsets", section.get("offsets"))
    return SessionBody(model=model.name, shape=shape)
