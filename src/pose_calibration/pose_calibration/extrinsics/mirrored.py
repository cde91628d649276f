"""Detects mirrored data, from the knees, which bend forwards only.

A mirrored image, or one axis that points the other way, turns a person into one whose knees bend
backwards. So does a tracker that takes a person's back for the front. If all views do that at all
times, nothing tells left from right, and the pose would be wrong by 30° and more.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.api import SkeletonSample
from pose_core.body.trunk import trunk_axes
from pose_core.joints import LEGS

MIN_BEND = 0.12  # [m] of the knee from the line between hip and foot: bent by about 30°
MIN_COSINE = 0.5  # [-] between a knee's direction and the forward axis
MIN_BENT = 60  # [-] bent knees of a sensor, below which nothing is concluded
MIRRORED_SHARE = 0.9  # [-] of bent knees that bend backwards
MAX_SAMPLES = 4000  # [-] used of each sensor


def refuse_mirrored(by_sensor: Mapping[str, Sequence[SkeletonSample]]) -> None:
    """Raise CalibrationError if the knees bend backwards in the views of all sensors."""
    shares = [_backwards_share(samples) for samples in by_sensor.values()]
    if shares and min(shares) > MIRRORED_SHARE:
        raise CalibrationError(
            f"the knees bend backwards in {100.0 * min(shares):.0f} % of the instants at which "
            f"they are bent, in {', '.join(by_sensor)}: the data are mirrored, or left and right "
            "are exchanged; turn off the tracker's mirroring, reverse the axis that is not x "
            "right, y down, z forward, or see that a tracker that takes a back for a front sees "
            "the front"
        )


def _backwards_share(samples: Sequence[SkeletonSample]) -> float:
    """Share of bent knees that bend backwards; 0 if there are few."""
    some = samples[:: max(1, len(samples) // MAX_SAMPLES)]
    joints = np.stack([each.tracked for each in some])
    forward = trunk_axes(joints)[..., 0]
    backwards = bent = 0
    for leg in LEGS:
        hip, knee, foot = joints[:, leg].swapaxes(0, 1)
        bend = knee - 0.5 * (hip + foot)
        length = np.linalg.norm(bend, axis=1)
        along = (bend * forward).sum(axis=1)
        is_bent = (length > MIN_BEND) & (np.abs(along) > MIN_COSINE * length)
        bent += int(is_bent.sum())
        backwards += int((is_bent & (along < 0.0)).sum())
    return backwards / bent if bent >= MIN_BENT else 0.0
