"""A person's bone lengths, from a first stretch of samples, and their YAML file.

li2020, 2.3: the mean over samples of both sensors, after removing clear outliers. The joints of
the rigid trunk keep their mean position in the trunk's axes; every other joint keeps its distance
from its parent joint. Joints that are never seen, such as the legs behind a table, take the
proportions of an average body.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.atomic_file import write_atomically
from pose_core.body.average_body import neutral_pose
from pose_core.body.model import BodyModel
from pose_core.body.trunk import mid_hip, trunk_axes
from pose_core.errors import InputError, PoseError
from pose_core.finite_numbers import are_known, finite_numbers, nan_mean, robust_stddev
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS, JOINTS, OTHER_SIDE
from pose_core.plain_yaml import dump_yaml, read_yaml

OUTLIER = 3.0  # [-] scaled median absolute deviations from the median
MIN_SPREAD = 0.005  # [m] lower bound of the spread, for the outlier test
MIN_SAMPLES = 10  # [-] for the outlier test
MIN_MEASURED = 5  # [-] joints that determine the size of an average body
UPRIGHT = np.radians(25.0)  # [rad] largest angle between thigh and trunk of a standing person
ARM_ENDS = JOINT_PAIRS["elbow"] + JOINT_PAIRS["hand"]
MAX_BONE = 1.0  # [m] plausibility limit
SIZES = (0.25, 1.7)  # [-] of an infant and a giant, relative to the average body


class BodyShapeError(PoseError):
    """The samples do not determine a body."""


@dataclass(frozen=True, kw_only=True)
class BodyShape:
    """Position of each joint in its link's axes."""

    offsets: FloatArray  # (15, 3) [m]
    assumed: tuple[str, ...] = ()  # joints that were not measured: an average body's proportions

    def bone_lengths(self) -> dict[str, float]:
        """Distance of each joint from its link's origin [m]."""
        return dict(zip(JOINTS, map(float, np.linalg.norm(self.offsets, axis=1)), strict=True))


def shape_of(model: BodyModel, neutral: FloatArray) -> BodyShape:
    """Body measures from the joints in the N-pose, shape (15, 3) [m]."""
    offsets = neutral.copy()
    for name, place in model.joints.items():
        joint = model.links[place.link].joint
        if joint is not None:
            offsets[JOINT_INDEX[name]] -= neutral[JOINT_INDEX[joint]]
    return BodyShape(offsets=offsets)


def estimate_body_shape(
    model: BodyModel, positions: FloatArray, *, assume_unseen: bool = False
) -> BodyShape:
    """Estimate a person's body measures.

    Args:
        model: The body model.
        positions: Samples of all sensors, each in any frame, shape (n, 15, 3) [m];
            NaN where not tracked.
        assume_unseen: Whether joints that were tracked too rarely take the proportions of an
            average body of the size of the others.

    Raises:
        BodyShapeError: If a joint was tracked too rarely; with ``assume_unseen``, if so many were
            that the size is unknown; or if it is no person's.
    """
    in_trunk = np.einsum(
        "nji,nkj->nki", trunk_axes(positions), positions - mid_hip(positions)[:, None, :]
    )
    # Links connected by the spine are parallel while the person stands: the waist's zero.
    upright = _upright(in_trunk)
    spine = _spine(model)
    if spine:
        upright[:, [index for index in range(len(JOINTS)) if index not in spine], 0] *= 0.0
    offsets = np.full((len(JOINTS), 3), np.nan)
    unseen: BodyShapeError | None = None
    for name in model.joints:
        index = JOINT_INDEX[name]
        try:
            offsets[index] = _measured_offset(model, name, positions, upright)
        except BodyShapeError as error:
            if not assume_unseen:
                raise
            unseen = unseen or error
    # Trackers have larger errors than real bodies have asymmetries. A joint that was measured on
    # one side only is the same on the other.
    mirrored = offsets * [1.0, -1.0, 1.0]
    offsets = nan_mean(np.stack([offsets, mirrored[OTHER_SIDE]]))
    measured = are_known(offsets)
    if unseen is not None and measured.sum() < MIN_MEASURED:
        raise unseen
    average = shape_of(model, neutral_pose()).offsets
    length, usual = (np.linalg.norm(each[measured], axis=1).sum() for each in (offsets, average))
    size = length / usual  # [-] of the person, relative to the average body
    if not SIZES[0] < size < SIZES[1]:
        raise BodyShapeError(
            f"its bones are {size:.2g} times as long as an average body's, expected {SIZES[0]} to "
            f"{SIZES[1]}: give positions in metres"
        )
    return BodyShape(
        offsets=np.where(measured[:, None], offsets, size * average),
        assumed=tuple(name for name in JOINTS if not measured[JOINT_INDEX[name]]),
    )


def _measured_offset(
    model: BodyModel, name: str, positions: FloatArray, upright: FloatArray
) -> FloatArray:
    """One joint's offset in its link, (3,) [m].

    Args:
        model: The body model.
        name: The joint.
        positions: See :func:`estimate_body_shape`.
        upright: Samples of a standing person in the trunk's axes, shape (m, 15, 3) [m].
    """
    place, index = model.joints[name], JOINT_INDEX[name]
    joint = model.links[place.link].joint
    if place.direction is None:
        origin = 0.0 if joint is None else upright[:, JOINT_INDEX[joint]]
        places = upright[:, index] - origin
        return np.array([_robust_mean(name, places[:, k]) for k in range(3)])
    if joint is None:
        raise BodyShapeError(f"joint {name} has a direction but no joint to measure from")
    bones = positions[:, index] - positions[:, JOINT_INDEX[joint]]
    return _robust_mean(name, np.linalg.norm(bones, axis=1)) * np.asarray(place.direction)


def with_shorter_arms(shape: BodyShape, factor: float) -> BodyShape:
    """The measures with the bones of the arms times a factor [-]."""
    offsets = shape.offsets.copy()
    offsets[ARM_ENDS] *= factor
    return replace(shape, offsets=offsets)


def _spine(model: BodyModel) -> list[int]:
    """Indices of the joints that connect links of the trunk; empty for a rigid trunk.

    The other joints whose position is measured are assumed to lie in the frontal plane.
    """
    measured = {place.link for place in model.joints.values() if place.direction is None}
    hung_on = (model.links[link].joint for link in measured)
    return [JOINT_INDEX[joint] for joint in hung_on if joint is not None]


def _upright(in_trunk: FloatArray) -> FloatArray:
    """The samples in which the thighs are in line with the trunk; all samples if these are too few.

    Args:
        in_trunk: Joints in the trunk's axes, shape (n, 15, 3) [m].
    """
    thighs = in_trunk[:, JOINT_PAIRS["knee"]] - in_trunk[:, JOINT_PAIRS["hip"]]
    hang = -thighs[..., 2] > np.cos(UPRIGHT) * np.linalg.norm(thighs, axis=-1)
    upright = in_trunk[hang.all(axis=1)]
    return upright if len(upright) >= MIN_SAMPLES else in_trunk


def _robust_mean(name: str, values: FloatArray) -> float:
    values = values[np.isfinite(values) & (np.abs(values) < MAX_BONE)]
    if len(values) < MIN_SAMPLES:
        raise BodyShapeError(
            f"joint {name} was seen whole in {len(values)} samples, at least {MIN_SAMPLES} are "
            "needed: stand where the sensors see the whole body"
        )
    deviations = np.abs(values - np.median(values))
    spread = max(float(robust_stddev(deviations)), MIN_SPREAD)
    return float(np.mean(values[deviations <= OUTLIER * spread]))


def save_body_shape(path: Path, model: BodyModel, shape: BodyShape, subject: str) -> None:
    """Write a person's body measures as YAML, atomically."""
    document = {
        "version": 1,
        "subject": subject,
        "body_model": model.name,
        "offsets": offsets_document(shape),
    }
    write_atomically(path, dump_yaml(document).encode(), "the body's measures")


def load_body_shape(path: Path, model: BodyModel) -> BodyShape:
    """Read a person's body measures.

    Raises:
        InputError: If the file is missing, is not such a file, or belongs to another model.
    """
    document = read_yaml(path, "the body's measures")
    if not isinstance(document, Mapping) or document.get("version") != 1:
        raise InputError(f"{path} holds no bone lengths: expected 'version: 1' and 'offsets'")
    if document.get("body_model") != model.name:
        raise InputError(
            f"{path} is for body model {document.get('body_model')}, not {model.name}: "
            "measure again"
        )
    return shape_of_offsets(f"{path}: offsets", document.get("offsets"))


def offsets_document(shape: BodyShape) -> dict[str, list[float]]:
    """Offset of each joint [m], as plain numbers in a file."""
    rounded = [[round(value, 5) + 0.0 for value in each] for each in shape.offsets.tolist()]
    return dict(zip(JOINTS, rounded, strict=True))


def shape_of_offsets(what: str, offsets: Any) -> BodyShape:
    """Body measures from a file's offset of each joint [m].

    Args:
        what: Name of the value in a message.
        offsets: The file's value.

    Raises:
        InputError: If a joint is missing, or an offset is not plausible.
    """
    if not isinstance(offsets, Mapping) or set(offsets) != set(JOINTS):
        found = sorted(map(str, offsets)) if isinstance(offsets, Mapping) else offsets
        raise InputError(
            f"{what} has {found!r}, expected all of {', '.join(JOINTS)}: "
            "calibrate again, or remove it to have the body measured"
        )
    for name, value in offsets.items():
        offset = finite_numbers(value, 3)
        if offset is None or not (np.abs(offset) < MAX_BONE).all():
            raise InputError(
                f"{what}/{name} is {value!r}, expected three numbers within ±{MAX_BONE:g} m"
            )
    return BodyShape(offsets=np.array([offsets[name] for name in JOINTS], float))
