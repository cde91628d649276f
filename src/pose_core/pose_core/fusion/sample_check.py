"""Checks of a recording's samples before they are fused: what cannot give a pose is refused."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from pose_core.errors import InputError
from pose_core.finite_numbers import nan_median
from pose_core.joints import FARTHEST_M, JOINTS
from pose_core.session.extrinsics import Extrinsics
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import reference_stamp_ns
from pose_core.streams.recording_order import WAIT_NS
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample

MIN_STEP_NS = 1_000_000  # [ns] between two frames of a camera: no tracker has 1000 Hz


def check_samples(
    samples: Sequence[SkeletonSample | ImuSample | ImuBlock],
    extrinsics: Extrinsics,
    wanted: Sequence[str] | None,
) -> None:
    """Refuse samples that no estimator can use.

    Args:
        samples: A recording's samples.
        extrinsics: Poses of the sensors.
        wanted: Names of the sensors to use; None: all.

    Raises:
        InputError: If a sample has another type, shape or unit than documented, or a sensor without
            extrinsics, or if stamps go back.
    """
    by_sensor: dict[str, list[SkeletonSample]] = defaultdict(list)
    newest_ns = np.iinfo(np.int64).min
    for place, sample in enumerate(samples):
        _check_sample(place, sample)
        if isinstance(sample, SkeletonSample):
            by_sensor[sample.sensor].append(sample)
            stamp_ns = reference_stamp_ns(sample, extrinsics.clocks)
            if stamp_ns < newest_ns - WAIT_NS:
                raise InputError(
                    f"samples[{place}] of sensor '{sample.sensor}' is stamped "
                    f"{(newest_ns - stamp_ns) / NS_PER_S:.3g} s before an earlier one: sort the "
                    "samples by stamp_ns"
                )
            newest_ns = max(newest_ns, stamp_ns)
    _check_names(tuple(by_sensor), extrinsics.sensors, wanted)
    for sensor, own in by_sensor.items():
        _check_units(sensor, own)


def _check_sample(place: int, sample: Any) -> None:
    """Check type and shape of one sample."""
    if not isinstance(sample, SkeletonSample | ImuSample | ImuBlock):
        raise InputError(
            f"samples[{place}] is a {type(sample).__name__}: expected a SkeletonSample, ImuSample "
            "or ImuBlock"
        )
    stamp = sample.stamps_ns[:1] if isinstance(sample, ImuBlock) else sample.stamp_ns
    if not np.issubdtype(np.asarray(stamp).dtype, np.integer):
        raise InputError(
            f"samples[{place}] has a stamp of type {np.asarray(stamp).dtype}: expected an integer "
            "of nanoseconds, round(1e9 * seconds)"
        )
    if isinstance(sample, SkeletonSample):
        expected = {"positions": (len(JOINTS), 3), "tracking_state": (len(JOINTS),)}
        for name, shape in expected.items():
            found = np.shape(getattr(sample, name))
            if found != shape:
                raise InputError(
                    f"samples[{place}].{name} has the shape {found}: expected an array of shape "
                    f"{shape}, the joints in the order of JOINTS, NaN where unknown"
                )


def _check_names(found: Sequence[str], placed: Sequence[str], wanted: Sequence[str] | None) -> None:
    """Check that the sensors have extrinsics, but for those that are not wanted."""
    missing = [name for name in found if name not in placed and name in (wanted or found)]
    if missing:
        raise InputError(
            f"samples are of sensor {', '.join(missing)}, the extrinsics have "
            f"{', '.join(placed)}: use the same names"
        )
    if found and wanted is not None and not set(found) & set(wanted):
        raise InputError(
            f"samples are of sensor {', '.join(found)}, the parameters have "
            f"{', '.join(wanted)}: name those in PipelineParameters(sensors=…)"
        )


def _check_units(sensor: str, samples: Sequence[SkeletonSample]) -> None:
    """Check that positions can be metres, and stamps nanoseconds."""
    distances = np.linalg.norm(np.array([each.positions for each in samples], float), axis=2)
    distance = float(nan_median(distances.ravel()))
    if distance > FARTHEST_M:
        raise InputError(
            f"joints are {distance:.0f} m from sensor '{sensor}' (median), expected at most "
            f"{FARTHEST_M:g} m: give positions in metres"
        )
    steps_ns = np.diff(np.unique([each.stamp_ns for each in samples]))
    if len(steps_ns) and np.median(steps_ns) < MIN_STEP_NS:
        raise InputError(
            f"frames of sensor '{sensor}' are {np.median(steps_ns):g} ns apart (median), expected "
            f"{MIN_STEP_NS} ns or more: give stamp_ns in nanoseconds"
        )
