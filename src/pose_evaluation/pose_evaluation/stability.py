"""Stability of a skeleton without a reference: bone lengths and jerk."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_core.api import FloatArray, SkeletonSeries
from pose_core.finite_numbers import mean_known
from pose_core.joints import JOINT_INDEX, LIMB_ENDS, SIDES

BONES: dict[str, tuple[str, str]] = {
    "neck": ("neck", "head"),
    **LIMB_ENDS,
    "shoulders": ("left_shoulder", "right_shoulder"),
    "hips": ("left_hip", "right_hip"),
}
"""Pairs of joints with a constant distance on a body."""
BONES_SHOWN = tuple(
    f"{side}_{bone}" for bone in ("thigh", "shank", "upper_arm", "forearm") for side in SIDES
)
"""Those of the limbs, without hands and feet, for figures."""

JERK_RATE = 30.0  # [Hz] for the jerk, which increases with the cube of the rate


@dataclass(frozen=True, kw_only=True)
class Stability:
    """Constancy of bone lengths and smoothness of joints."""

    bone_sd_mm: Mapping[str, float]  # [mm] standard deviation by bone
    jerk: Mapping[str, float]  # [m/s³] RMS by joint

    @property
    def mean_bone_sd_mm(self) -> float:
        """Mean standard deviation of bone lengths [mm]."""
        return mean_known(list(self.bone_sd_mm.values()))

    @property
    def mean_jerk(self) -> float:
        """Mean RMS jerk over the joints [m/s³]."""
        return mean_known(list(self.jerk.values()))


def bone_lengths(positions: FloatArray) -> dict[str, FloatArray]:
    """Length [m] of each bone (:data:`BONES`), shape (n,), from positions (n, 15, 3)."""
    return {
        bone: np.linalg.norm(
            positions[:, JOINT_INDEX[end]] - positions[:, JOINT_INDEX[top]], axis=1
        )
        for bone, (top, end) in BONES.items()
    }


def bone_length_sd_mm(positions: FloatArray) -> dict[str, float]:
    """SD [mm] of each bone's length in joints (n, 15, 3) [m]; NaN if it was never tracked."""
    return {bone: 1000.0 * _sd(length) for bone, length in bone_lengths(positions).items()}


def bone_length_cv_percent(positions: FloatArray) -> dict[str, float]:
    """SD of each bone's length over its mean [%], in joints (n, 15, 3) [m]."""
    return {bone: _cv_percent(length) for bone, length in bone_lengths(positions).items()}


def rms_jerk(series: SkeletonSeries) -> dict[str, float]:
    """RMS jerk [m/s³] of each joint: third differences of its position at 30 Hz.

    Instants next to a gap or an unknown position are left out; NaN where none is left.
    """
    differences = [
        np.diff(positions, n=3, axis=0) * JERK_RATE**3 for positions in series.on_grids(JERK_RATE)
    ]
    squared = np.sum(np.concatenate([np.zeros((0, 15, 3)), *differences]) ** 2, axis=2)
    return {
        name: float(np.sqrt(mean_known(squared[:, index]))) for name, index in JOINT_INDEX.items()
    }


def _sd(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(known.std()) if len(known) else np.nan


def _cv_percent(values: FloatArray) -> float:
    mean = mean_known(values)
    return 100.0 * _sd(values) / mean if mean > 0.0 else np.nan
