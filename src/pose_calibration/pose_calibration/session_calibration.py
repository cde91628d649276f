"""Calibration of a whole recording: clocks, extrinsics, floor, the person's body measures.

Used by ``./pose calibrate`` and ``./pose fuse``.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_calibration.body_measures import measure_body
from pose_calibration.clocks.clock_offset import ClockOffset, estimate_clock_offsets
from pose_calibration.clocks.recorded_stamps import with_recorded_stamps
from pose_calibration.extrinsics.extrinsics_calibration import ExtrinsicsCalibrator
from pose_calibration.extrinsics.mirrored import refuse_mirrored
from pose_calibration.extrinsics.moved_sensors import (
    BySensor,
    Displaced,
    MovedDuring,
    find_moved,
    find_moved_or_displaced,
)
from pose_calibration.extrinsics.parameters import CalibrationParameters
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.inertial.imu_clock import ImuFindings, imu_findings
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.people.calibration_person import match_people, with_id
from pose_core.api import (
    AlignedFrame,
    Clock,
    Clocks,
    Extrinsics,
    ImuBlock,
    ImuSample,
    RepeatedFrames,
    SensorFrame,
    SkeletonSample,
    TimeAligner,
    TrackingState,
    joined,
    on_reference_clock,
)
from pose_core.stamps import NS_PER_S

MAX_CLOCK_OFFSET_S = 0.5  # [s] of the search
FARTHEST_CLOCK_OFFSET_S = 5.0  # [s] of a second search, if the first finds no offset
MIN_CLOCK_OFFSET_S = 0.01  # [s] smaller ones are as likely a tracker's lag
TOGETHER = 1000  # [-] blocks of IMUs' samples that are stored at once
MAX_TRIED = 3  # [-] people tried, one after the other


@dataclass(frozen=True, kw_only=True)
class SessionCalibration:
    """Calibration of a recording's sensors."""

    extrinsics: Extrinsics  # with the clocks and the person's body measures
    clock_offsets: Mapping[str, ClockOffset]  # by sensor, without the reference
    imus: ImuFindings | None  # None without IMUs
    people: int = 1  # [-] largest number in one frame; one of them was used
    moved: tuple[MovedDuring, ...] = ()  # sensors that were moved during the recording

    @property
    def people_line(self) -> str:
        """One line about the person used; empty if there was only one."""
        if self.people < 2:
            return ""
        return f"{self.people} people at once: calibrated with the one whose views agree longest"


def calibrate(
    samples: Iterable[SkeletonSample | ImuSample | ImuBlock],
    sensors: Sequence[str],
    parameters: CalibrationParameters | None = None,
) -> SessionCalibration:
    """Calibrate a recorded session.

    Args:
        samples: One person's skeletons of all sensors, each sensor's in the order of time, and the
            IMUs' samples if they are to be used.
        sensors: The sensors' names, the reference first; samples of others are left out. With a
            single one, only the floor is found.
        parameters: Quality that the calibration must reach, known tilt and height of the reference.

    Raises:
        CalibrationError: If the recording does not determine it; the message says why.
    """
    by_sensor, memory = _sorted(samples, sensors)
    refuse_mirrored(by_sensor)
    offsets, clocks = _clock_offsets(by_sensor, sensors)
    frames = _aligned(by_sensor, clocks)
    calibrator = ExtrinsicsCalibrator(sensors, parameters)
    for frame in frames:
        calibrator.add(frame)
    extrinsics = replace(calibrator.solve(), clocks=clocks)
    found = None
    if memory.segments:
        found = _imu_findings(extrinsics, by_sensor, memory)
        if found.gravity is not None:
            extrinsics = calibrator.leveled(extrinsics, found.gravity)
        extrinsics = replace(extrinsics, clocks={**clocks, **found.clocks})
    return SessionCalibration(
        extrinsics=replace(extrinsics, body=measure_body(_all(by_sensor), assume_unseen=True)),
        clock_offsets=offsets,
        imus=found,
        moved=find_moved(by_sensor, extrinsics),
    )


def calibrate_people(
    frames: Iterable[SensorFrame | ImuBlock],
    sensors: Sequence[str],
    parameters: CalibrationParameters | None = None,
) -> SessionCalibration:
    """Calibrate a recorded session in which there may be several people.

    Args:
        frames: Frames of all sensors with all persons, and the IMUs' samples if they are used.
        sensors: See :func:`calibrate`.
        parameters: See :func:`calibrate`; and the person's id in all sensors.

    Raises:
        CalibrationError: If the recording does not determine it; the message says why.
        InputError: See :func:`complete`.
    """
    every = list(frames)
    frames_kept, blocks = _frames_and_blocks(every)
    person = "" if parameters is None else parameters.person
    candidates = _candidates(frames_kept, sensors, person)
    failure: CalibrationError | None = None
    for samples in candidates[:MAX_TRIED]:
        try:
            found = calibrate([*samples, *blocks], sensors, parameters)
        except CalibrationError as error:
            failure = failure or error
            continue
        clocks = with_recorded_stamps(every, sensors[0], found.extrinsics.clocks)
        return replace(
            found,
            extrinsics=replace(found.extrinsics, clocks=clocks),
            people=max(len(frame) for frame in frames_kept),
        )
    with_recorded_stamps(every, sensors[0], {})
    raise failure or CalibrationError("found no skeletons")


def complete(frames: Iterable[SensorFrame | ImuBlock], extrinsics: Extrinsics) -> Extrinsics:
    """Known poses of a recorded session's sensors, with what they lack: clocks and body measures.

    Offsets of clocks below :data:`MIN_CLOCK_OFFSET_S` are left out.

    Args:
        frames: See :func:`calibrate_people`.
        extrinsics: The known poses; their clocks and body measures are kept, if there are any.

    Raises:
        CalibrationError: If a sensor has no skeletons, or no person's views agree.
        InputError: If stamps are far apart, and the motion does not tell the clocks' offsets.
    """
    every = list(frames)
    frames_kept, blocks = _frames_and_blocks(every)
    samples = _candidates(frames_kept, extrinsics.sensors, "")[0]
    by_sensor, memory = _sorted([*samples, *blocks], extrinsics.sensors)
    if extrinsics.body is None:
        extrinsics = replace(extrinsics, body=measure_body(_all(by_sensor), assume_unseen=True))
    if extrinsics.clocks:
        return extrinsics
    duration_s = (samples[-1].stamp_ns - samples[0].stamp_ns) / NS_PER_S
    offsets, clocks = _clock_offsets(by_sensor, extrinsics.sensors)
    clocks = {
        name: clock
        for name, clock in clocks.items()
        if abs(offsets[name].estimate_s) + abs(clock.drift) * duration_s > MIN_CLOCK_OFFSET_S
    }
    extrinsics = replace(extrinsics, clocks=clocks)
    if memory.segments:
        found = _imu_findings(extrinsics, by_sensor, memory)
        extrinsics = replace(extrinsics, clocks={**clocks, **found.clocks})
    checked = with_recorded_stamps(every, extrinsics.reference, extrinsics.clocks)
    return replace(extrinsics, clocks=checked)


def moved_sensors(
    frames: Iterable[SensorFrame | ImuBlock], extrinsics: Extrinsics
) -> tuple[Displaced | MovedDuring, ...]:
    """What a recording's views say against given extrinsics; nothing where no views agree.

    Args:
        frames: See :func:`calibrate_people`.
        extrinsics: As given, with clocks.
    """
    frames_kept, _ = _frames_and_blocks(list(frames))
    try:
        samples = _candidates(frames_kept, extrinsics.sensors, "")[0]
        by_sensor, _ = _sorted(samples, extrinsics.sensors)
    except CalibrationError:
        return ()
    return find_moved_or_displaced(by_sensor, extrinsics)


def _clock_offsets(
    by_sensor: BySensor, sensors: Sequence[str]
) -> tuple[dict[str, ClockOffset], dict[str, Clock]]:
    """See :func:`estimate_clock_offsets`; an offset that is not found is searched farther."""
    offsets, clocks = estimate_clock_offsets(by_sensor, sensors, MAX_CLOCK_OFFSET_S)
    unknown = [name for name, offset in offsets.items() if not offset.observable]
    again = (sensors[0], *unknown)
    more, more_clocks = estimate_clock_offsets(by_sensor, again, FARTHEST_CLOCK_OFFSET_S)
    return {**offsets, **more}, {**clocks, **more_clocks}


def _imu_findings(extrinsics: Extrinsics, by_sensor: BySensor, memory: ImuMemory) -> ImuFindings:
    """See :func:`imu_findings`; an offset that is not found is searched farther."""
    found = imu_findings(extrinsics, by_sensor, memory, MAX_CLOCK_OFFSET_S)
    if np.isfinite(found.offset_stddev_s):
        return found
    return imu_findings(extrinsics, by_sensor, memory, FARTHEST_CLOCK_OFFSET_S)


def _all(by_sensor: BySensor) -> list[SkeletonSample]:
    return [one for ones in by_sensor.values() for one in ones]


def _frames_and_blocks(
    frames: Sequence[SensorFrame | ImuBlock],
) -> tuple[list[SensorFrame], list[ImuBlock]]:
    """The frames with somebody in them that are not repeated on and on, and the IMUs' samples."""
    repeated = RepeatedFrames()
    frames_kept = [
        each
        for each in frames
        if not isinstance(each, ImuBlock) and each and not repeated.is_frozen(each[0].sensor, each)
    ]
    return frames_kept, [each for each in frames if isinstance(each, ImuBlock) and len(each)]


def _candidates(
    frames: Sequence[SensorFrame], sensors: Sequence[str], person: str
) -> list[list[SkeletonSample]]:
    """Samples of each person who may be used, the best first.

    Raises:
        CalibrationError: If there are several and no person's views agree.
    """
    if person:
        return [[one for frame in frames for one in with_id(frame, person)]]
    if all(len(frame) <= 1 for frame in frames):
        return [[frame[0] for frame in frames]]
    candidates = list(match_people(frames, sensors)[1].values())
    if not candidates:
        raise CalibrationError(
            f"several people are detected, and views in {', '.join(sensors)} agree on none: "
            "walk about alone in view of the sensors, or name a person with --person"
        )
    return candidates


def _sorted(
    samples: Iterable[SkeletonSample | ImuSample | ImuBlock], sensors: Sequence[str]
) -> tuple[dict[str, list[SkeletonSample]], ImuMemory]:
    """The samples by sensor, stamps ascending, and the IMUs' orientations."""
    by_sensor: dict[str, list[SkeletonSample]] = {name: [] for name in sensors}
    imus: list[ImuSample | ImuBlock] = []
    for sample in samples:
        if not isinstance(sample, SkeletonSample):
            imus.append(sample)
        elif sample.sensor in by_sensor:
            by_sensor[sample.sensor].append(sample)
    memory = ImuMemory()
    for first in range(0, len(imus), TOGETHER):
        memory.add(joined(imus[first : first + TOGETHER]))
    for name, ones in by_sensor.items():
        ones.sort(key=lambda one: one.stamp_ns)
        if not ones:
            raise CalibrationError(
                f"found no skeletons of '{name}', expected some from each of {', '.join(sensors)}"
            )
        if not any(map(_shows_a_body, ones)):
            raise CalibrationError(
                f"no skeleton of '{name}' shows anybody: all its joints are untracked, not a "
                "number, or at one place"
            )
    return by_sensor, memory


def _shows_a_body(sample: SkeletonSample) -> bool:
    known = sample.positions[sample.tracking_state != int(TrackingState.NOT_TRACKED)]
    known = known[np.isfinite(known).all(axis=1)]
    return len(known) > 1 and bool(np.ptp(known, axis=0).any())


def _aligned(by_sensor: BySensor, clocks: Clocks) -> list[AlignedFrame]:
    aligner = TimeAligner(tuple(by_sensor))
    samples = [on_reference_clock(one, clocks) for one in _all(by_sensor)]
    samples.sort(key=lambda one: one.stamp_ns)
    return [*(frame for one in samples for frame in aligner.add(one)), *aligner.flush()]
