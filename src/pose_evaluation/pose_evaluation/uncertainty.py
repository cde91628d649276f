"""Consistency of a method's own uncertainty: share of errors within 1 and 2 σ."""

from dataclasses import dataclass

import numpy as np

from pose_core.api import (
    ANGLES,
    AngleSeries,
    EstimateSeries,
    FloatArray,
    IntArray,
    without_sideways_flexion,
    wrapped,
)

NORMAL_SHARE = (0.6827, 0.9545)  # [-] of a normal distribution within 1 and 2 σ


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """Shares of one angle's errors within the published uncertainty."""

    within_1: float  # [-] share of the instants with an error below 1 σ
    within_2: float  # [-] below 2 σ
    mean_stddev_deg: float  # [deg] published
    samples: int  # [-]


def uncertainty_coverage(
    estimates: EstimateSeries, reference: AngleSeries, shift_s: float
) -> dict[str, Coverage]:
    """Compare the errors of the published angles with their standard deviations.

    Flexions are left out where the true limb points sideways.

    Args:
        estimates: The degrees of freedom; those named as angles are used.
        reference: The true angles.
        shift_s: Delay of the method's stamps [s].

    Returns:
        By angle; angles without a standard deviation or a reference are left out.
    """
    stamps_ns = estimates.stamps_ns - round(shift_s * 1e9)
    expected = without_sideways_flexion(reference.at(stamps_ns))
    result = {}
    for angle in ANGLES:
        if angle not in estimates.names:
            continue
        column = estimates.names.index(angle)
        stddev = estimates.position_stddev[:, column]
        error = np.abs(wrapped(estimates.position[:, column] - expected[angle]))
        known = np.isfinite(error) & np.isfinite(stddev)
        if known.any():
            error, stddev = error[known], stddev[known]
            result[angle] = Coverage(
                within_1=float(np.mean(error <= stddev)),
                within_2=float(np.mean(error <= 2.0 * stddev)),
                mean_stddev_deg=float(np.degrees(stddev.mean())),
                samples=len(error),
            )
    return result


def mean_coverage(coverage: dict[str, Coverage]) -> Coverage:
    """Coverage of all angles together."""
    count = sum(each.samples for each in coverage.values())

    def mean(field: str) -> float:
        total = sum(getattr(each, field) * each.samples for each in coverage.values())
        return float(total / count) if count else np.nan

    return Coverage(
        within_1=mean("within_1"),
        within_2=mean("within_2"),
        mean_stddev_deg=mean("mean_stddev_deg"),
        samples=count,
    )


def stddev_at(estimates: EstimateSeries, angle: str, stamps_ns: IntArray) -> FloatArray:
    """Published standard deviation of an angle at n other instants, (n,) [rad]; NaN if unknown."""
    if angle not in estimates.names or len(estimates.stamps_ns) == 0:
        return np.full(len(stamps_ns), np.nan)
    begin_ns = int(estimates.stamps_ns[0])
    return np.interp(
        (stamps_ns - begin_ns).astype(float),
        (estimates.stamps_ns - begin_ns).astype(float),
        estimates.position_stddev[:, estimates.names.index(angle)],
        left=np.nan,
        right=np.nan,
    )
