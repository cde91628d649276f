"""Calibration of a whole recording: clocks, extrinsics, floor, the person's body measures.

Used by ``./pose calibrate`` and ``./pose fuse``.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pose_calibration.body_measures import measure_body
from pose_calibration.clocks.clock_offset import ClockOffset, estimate_clock_offset
from pose_calibration.extrinsics.extrinsics_calibration import (
    CalibrationLimits,
    ExtrinsicsCalibrator,
)
from pose_calibration.floor.floor import KnownMounting
from pose_calibration.inertial.imu_clock import ImuFindings, imu_findings
from pose_calibration.inertial.imu_motion import ImuMemory
from pose_calibration.people.calibration_person import match_people, only_person, with_id
from pose_calibration.rigid_transform import CalibrationError
from pose_core.api import (
    IMUS,
    AlignedFrame,
    Clocks,
    Extrinsics,
    ImuBlock,
    SkeletonSample,
    TimeAligner,
    on_reference_clock,
)

MOST_TRIED = 3  # [-] people tried, one after the other


@dataclass(frozen=True, kw_only=True)
class SessionCalibration:
    """Calibration of a recording's sensors."""

    extrinsics: Extrinsics  # with the clocks and the person's body measures
    clock_offsets: Mapping[str, ClockOffset]  # by sensor, without the reference
    imus: ImuFindings | None  # None without IMUs
    people: int = 1  # [-] largest number in one frame; one of them was used

    @property
    def people_line(self) -> str:
        """One line about the person used; empty if there was only one."""
        if self.people < 2:
            return ""
        return f"{self.people} people at once: calibrated with the one whose views agree longest"


def calibrate(
    samples: Iterable[SkeletonSample | ImuBlock],
    sensors: Sequence[str],
    *,
    limits: CalibrationLimits | None = None,
    mounting: KnownMounting | None = None,
    find_clock_offsets: bool = True,
    max_clock_offset_s: float = 0.5,
) -> SessionCalibration:
    """Calibrate a recorded session.

    Args:
        samples: One person's skeletons of all sensors, each sensor's in the order of time, and the
            IMUs' samples if they are to be used.
        sensors: The sensors' names, the reference first; samples of others are left out. With a
            single one, only the floor is found.
        limits: Quality that the calibration must reach.
        mounting: Known tilt and height of the reference sensor.
        find_clock_offsets: Whether to estimate the offsets between the sources' clocks.
        max_clock_offset_s: Largest offset [s] of the search.

    Raises:
        CalibrationError: If the recording does not determine it; the message says why.
    """
    by_sensor, memory = _sorted(samples, sensors)
    offsets = {
        name: estimate_clock_offset(by_sensor[sensors[0]], by_sensor[name], max_clock_offset_s)
        for name in sensors[1:]
        if find_clock_offsets
    }
    clocks = {name: one.clock for name, one in offsets.items() if one.clock is not None}
    frames = _aligned(by_sensor, clocks)
    calibrator = ExtrinsicsCalibrator(sensors, limits, mounting)
    for frame in frames:
        calibrator.add(frame)
    extrinsics = replace(calibrator.solve(), clocks=clocks)
    found = None
    if memory.segments:
        found = imu_findings(extrinsics, by_sensor, memory, max_clock_offset_s)
        if found.gravity is not None:
            extrinsics = calibrator.leveled(extrinsics, found.gravity)
        if found.clock is not None and find_clock_offsets:
            extrinsics = replace(extrinsics, clocks={**clocks, IMUS: found.clock})
    T_map_sensor = {name: extrinsics.T_map_sensor(name) for name in extrinsics.sensors}
    return SessionCalibration(
        extrinsics=replace(extrinsics, body=measure_body(frames, T_map_sensor)),
        clock_offsets=offsets,
        imus=found,
    )


def calibrate_people(
    frames: Iterable[Sequence[SkeletonSample] | ImuBlock],
    sensors: Sequence[str],
    person: str = "",
    **options: Any,
) -> SessionCalibration:
    """Calibrate a recorded session in which there may be several people.

    Args:
        frames: Frames of all sensors with all persons, and the IMUs' samples if they are used.
        sensors: See :func:`calibrate`.
        person: The person's id in all sensors; if empty, a person whose views agree.
        **options: See :func:`calibrate`.

    Raises:
        CalibrationError: If the recording does not determine it; the message says why.
    """
    blocks: list[ImuBlock] = []
    frames_kept: list[Sequence[SkeletonSample]] = []
    for each in frames:
        if isinstance(each, ImuBlock):
            blocks.append(each)
        elif each:
            frames_kept.append(each)
    if person:
        candidates = [[one for frame in frames_kept for one in with_id(frame, person)]]
    elif only_person(frames_kept):
        candidates = [[frame[0] for frame in frames_kept]]
    else:
        candidates = list(match_people(frames_kept, sensors).samples.values())
        if not candidates:
            raise CalibrationError(
                f"several people are detected, and views in {', '.join(sensors)} agree on none: "
                "walk about alone in view of the sensors, or name a person with --person"
            )
    failure: CalibrationError | None = None
    for samples in candidates[:MOST_TRIED]:
        try:
            found = calibrate([*samples, *blocks], sensors, **options)
        except CalibrationError as error:
            failure = failure or error
            continue
        return replace(found, people=max(len(frame) for frame in frames_kept))
    raise failure or CalibrationError("found no skeletons")


def _sorted(
    samples: Iterable[SkeletonSample | ImuBlock], sensors: Sequence[str]
) -> tuple[dict[str, list[SkeletonSample]], ImuMemory]:
    """The samples by sensor, stamps ascending, and the IMUs' orientations."""
    by_sensor: dict[str, list[SkeletonSample]] = {name: [] for name in sensors}
    memory = ImuMemory()
    for sample in samples:
        if isinstance(sample, ImuBlock):
            memory.add(sample)
        elif sample.sensor in by_sensor:
            by_sensor[sample.sensor].append(sample)
    for name, ones in by_sensor.items():
        ones.sort(key=lambda one: one.stamp_ns)
        if not ones:
            raise CalibrationError(
                f"found no skeletons of '{name}', expected some from each of {', '.join(sensors)}"
            )
    return by_sensor, memory


def _aligned(
    by_sensor: Mapping[str, Sequence[SkeletonSample]], clocks: Clocks
) -> list[AlignedFrame]:
    aligner = TimeAligner(tuple(by_sensor))
    ordered = sorted(
        (on_reference_clock(one, clocks) for ones in by_sensor.values() for one in ones),
        key=lambda one: one.stamp_ns,
    )
    frames = [frame for sample in ordered for frame in aligner.add(sample)]
    return frames + aligner.flush()
