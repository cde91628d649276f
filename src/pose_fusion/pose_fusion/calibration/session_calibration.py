"""A whole recording in, its calibration out: clock offsets, extrinsics, floor.

What ``./pose calibrate`` and ``./pose fuse`` do with a recorded session.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from pose_fusion.calibration.clock_offset import ClockOffset, estimate_clock_offset
from pose_fusion.calibration.clocks import Clock, on_reference_clock
from pose_fusion.calibration.extrinsics import Extrinsics
from pose_fusion.calibration.extrinsics_calibration import CalibrationLimits, ExtrinsicsCalibrator
from pose_fusion.calibration.floor import KnownMounting
from pose_fusion.calibration.rigid_transform import CalibrationError
from pose_fusion.streams.samples import SkeletonSample
from pose_fusion.streams.time_alignment import TimeAligner


@dataclass(frozen=True, kw_only=True)
class SessionCalibration:
    """What a recording tells of its sensors."""

    extrinsics: Extrinsics  # with the clock offsets
    clock_offsets: Mapping[str, ClockOffset]  # by sensor, without the reference
    samples: Mapping[str, int]  # [-] skeletons by sensor
    frames: int  # [-] aligned instants
    counts: Mapping[str, int]  # of the time alignment, by reason


def calibrate(
    samples: Iterable[SkeletonSample],
    sensors: Sequence[str],
    *,
    limits: CalibrationLimits | None = None,
    mounting: KnownMounting | None = None,
    find_clock_offsets: bool = True,
    max_clock_offset_s: float = 0.5,
) -> SessionCalibration:
    """Calibrate a recorded session.

    Args:
        samples: One person's skeletons of all sensors; each sensor's in the order of time.
        sensors: The sensors' names, the reference first; samples of others are left out. With a
            single one, only the floor is found.
        limits: What the calibration has to reach.
        mounting: What is known of the reference sensor's mounting.
        find_clock_offsets: Also find the offsets between the sensors' clocks.
        max_clock_offset_s: Largest offset [s] to look for.

    Raises:
        CalibrationError: If the recording does not determine it; the message says why.
    """
    by_sensor: dict[str, list[SkeletonSample]] = {name: [] for name in sensors}
    for sample in samples:
        if sample.sensor in by_sensor:
            by_sensor[sample.sensor].append(sample)
    for name, ones in by_sensor.items():
        ones.sort(key=lambda one: one.stamp_ns)
        if not ones:
            raise CalibrationError(
                f"found no skeletons of '{name}', expected some from each of {', '.join(sensors)}"
            )
    reference = by_sensor[sensors[0]]
    offsets = {
        name: estimate_clock_offset(reference, by_sensor[name], max_clock_offset_s)
        for name in sensors[1:]
        if find_clock_offsets
    }
    clocks = {
        name: Clock(offset_ns=one.offset_ns, stddev_s=one.stddev_s)
        for name, one in offsets.items()
        if one.offset_ns
    }
    aligner = TimeAligner(sensors)
    calibrator = ExtrinsicsCalibrator(sensors, limits, mounting)
    ordered = sorted(
        (on_reference_clock(one, clocks) for ones in by_sensor.values() for one in ones),
        key=lambda one: one.stamp_ns,
    )
    for sample in ordered:
        for frame in aligner.add(sample):
            calibrator.add(frame)
    for frame in aligner.flush():
        calibrator.add(frame)
    return SessionCalibration(
        extrinsics=replace(calibrator.solve(), clocks=clocks),
        clock_offsets=offsets,
        samples={name: len(ones) for name, ones in by_sensor.items()},
        frames=aligner.counters["frames"],
        counts=aligner.counters.as_dict(),
    )
