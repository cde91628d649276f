"""The section ``body`` of a session's file: the person's measures.

.. code-block:: yaml

    body:
      body_model: default
      bone_lengths: {left_knee: 0.431, ...}  # [m] from the joint before, for people
      offsets: {left_knee: [0.0, 0.0, -0.431], ...}  # [m] in the axes of the link it is fixed in
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pose_common.errors import InputError
from pose_common.finite_numbers import finite_numbers
from pose_common.joints import JOINT_INDEX, JOINTS, TrackingState
from pose_fusion.body.model import BodyModel, load_body_model
from pose_fusion.body.shape import LONGEST_BONE, BodyShape, BodyShapeError, estimate_body_shape
from pose_fusion.calibration.file_values import rounded
from pose_fusion.calibration.neutral_stand import NeutralStandWatcher
from pose_fusion.streams.samples import FloatArray
from pose_fusion.streams.time_alignment import AlignedFrame

MODEL = "default"  # whose measures a calibration takes
MOST_FRAMES = 2000  # [-] that measures are taken from where nobody stood neutrally


@dataclass(frozen=True, kw_only=True)
class SessionBody:
    """A person's measures, and the body model whose links they are given in."""

    model: str
    shape: BodyShape


def measure_body(
    frames: Iterable[AlignedFrame], T_map_sensor: Mapping[str, FloatArray]
) -> SessionBody | None:
    """The person's measures: from their first neutral stand, else from all that was seen.

    Args:
        frames: What the sensors saw, in the order of time.
        T_map_sensor: Where they stand, (4, 4) by sensor.

    Returns:
        The measures; None if a joint was tracked too rarely.
    """
    model = load_body_model(MODEL)
    watcher = NeutralStandWatcher(model)
    tracked: list[FloatArray] = []
    for frame in frames:
        positions = np.full((len(T_map_sensor), len(JOINTS), 3), np.nan)
        state = np.zeros((len(T_map_sensor), len(JOINTS)), np.uint8)
        for index, (name, T) in enumerate(T_map_sensor.items()):
            sample = frame.samples.get(name)
            if sample is not None:
                positions[index] = sample.positions @ T[:3, :3].T + T[:3, 3]
                state[index] = sample.tracking_state
        stand = watcher.add(frame.stamp_ns, positions, state)
        if stand is not None:
            return SessionBody(model=model.name, shape=stand.shape)
        tracked.append(np.where((state == TrackingState.TRACKED)[..., None], positions, np.nan))
    if not tracked:
        return None
    step = max(1, len(tracked) // MOST_FRAMES)
    try:
        shape = estimate_body_shape(model, np.concatenate(tracked[::step]))
    except BodyShapeError:
        return None
    return SessionBody(model=model.name, shape=shape)


def body_document(body: SessionBody) -> dict[str, Any]:
    """Measures as plain values."""
    lengths = body.shape.bone_lengths()
    return {
        "body_model": body.model,
        "bone_lengths": {name: round(length, 4) for name, length in lengths.items()},
        "offsets": {
            name: [rounded(value, 5) for value in body.shape.offsets[index]]
            for name, index in JOINT_INDEX.items()
        },
    }


def read_body(path: Path, section: Any) -> SessionBody | None:
    """The measures in a session's document; None if it has no such section.

    Raises:
        InputError: If the section is not what it should be.
    """
    if section is None:
        return None
    if not isinstance(section, Mapping):
        raise InputError(f"{path}: 'body' is {section!r}, expected a mapping")
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
