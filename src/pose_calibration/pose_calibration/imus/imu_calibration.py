"""Sensor-to-segment calibration of IMUs, live and offline: N-pose, then motion."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.alignment_fit import fit_alignments
from pose_calibration.imus.explaining import Explanations, explain
from pose_calibration.imus.guidance import how_to_move, wanted_stddev, what_is_missing
from pose_calibration.imus.observations import ImuObservations, ObservationRecorder
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.api import (
    Clocks,
    Extrinsics,
    ImuBlock,
    SensorsToSegments,
    SensorToSegment,
    SkeletonSample,
    load_body_model,
)
from pose_core.joints import SEGMENTS

LEAST_SAMPLED = 0.8  # [-] required share of the time with samples
MOVED = math.radians(25.0)  # [rad] rotation of a segment from which on its sensor must rotate
UNMOVED = math.radians(6.0)  # [rad] largest rotation of a sensor that is not worn
MOST = 95.0  # [%] percentile used as the largest angle
ALIKE, OPPOSITE = 0.5, -0.5  # [-] cosines between sensors' axes along the body
LEAST_TO_COMPARE = 4  # [-] sensors required to compare one with the others
ATTEMPT_EVERY_S = 2.0  # [s] of motion
STOOD = 0.2  # [-] share of the N-pose in the progress
STAND = "stand still, upright, arms hanging, palms to the thighs, for 2 s"


@dataclass(frozen=True)
class ImuFinding:
    """A fault of the sensors of some segments, or a remark about them."""

    segments: tuple[str, ...]
    text: str


def faults_of(observations: ImuObservations, explanations: Explanations) -> list[ImuFinding]:
    """Faults that make a sensor unusable."""
    found = [*_silent(observations), *_unmoved(observations)]
    found += [
        ImuFinding(
            (first, second),
            f"the sensors of {first} and {second} are exchanged: exchange them in the nodes "
            "file, or on the body",
        )
        for first, second in explanations.swapped
        if not _segments_of(found) & {first, second}
    ]
    found += [
        ImuFinding(
            (segment,),
            f"the sensor of {segment} rotates the wrong way round: its reference frame is "
            "upside down (z points down); have it send z up (ENU), or raw data",
        )
        for segment in explanations.upside_down
        if segment not in _segments_of(found)
    ]
    return found


def _segments_of(findings: Iterable[ImuFinding]) -> set[str]:
    return {segment for finding in findings for segment in finding.segments}


def remarks_on(alignments: Mapping[str, SensorToSegment]) -> list[ImuFinding]:
    """Unusual but accepted mountings: sensors inverted relative to the others."""
    if len(alignments) < LEAST_TO_COMPARE:
        return []
    names = list(alignments)
    along = np.stack([each.R_sensor_segment[:, 2] for each in alignments.values()])
    cosine = along @ along.T
    usual = [i for i in range(len(names)) if np.median(cosine[i]) > ALIKE]
    if len(usual) <= len(names) // 2:
        return []
    return [
        ImuFinding(
            (name,),
            f"the sensor of {name} sits upside down, compared with the others: this is allowed, "
            "but check whether it is intended",
        )
        for i, name in enumerate(names)
        if np.median(cosine[i, usual]) < OPPOSITE
    ]


def uncertain(alignments: Mapping[str, SensorToSegment], enough: float) -> list[ImuFinding]:
    """Alignments with standard deviations above ``enough`` [rad] that motion could reduce."""
    return [
        ImuFinding(
            (segment,),
            f"{segment} is known to {np.degrees(wanted_stddev(segment, alignment)):.0f} deg only: "
            f"calibrate again and {how_to_move(segment)}",
        )
        for segment, alignment in alignments.items()
        if wanted_stddev(segment, alignment) > enough
    ]


def _silent(o: ImuObservations) -> Iterator[ImuFinding]:
    heard = np.isfinite(o.rate).mean(axis=0)
    standing = np.isfinite(o.rate[o.is_neutral]).mean(axis=0)
    for segment, share, then in zip(o.segments, heard, standing, strict=True):
        if then == 0.0 or share < LEAST_SAMPLED:
            only = f"sent samples only {share:.0%} of the time"
            how = "was silent while you stood still" if then == 0.0 else only
            yield ImuFinding((segment,), f"the sensor of {segment} {how}: check its cable or radio")


def _unmoved(o: ImuObservations) -> Iterator[ImuFinding]:
    for i, segment in enumerate(o.segments):
        axis, R = o.long_axis[:, i], o.R_world_sensor[:, i]
        axis, R = axis[np.isfinite(axis[:, 0])], R[np.isfinite(R[:, 0, 0])]
        if len(axis) == 0 or len(R) == 0:
            continue
        inclination = np.percentile(np.arccos(np.clip(axis[:, 2], -1.0, 1.0)), MOST)
        trace = np.einsum("nij,ij->n", R, R[0])
        turned = np.percentile(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)), MOST)
        if inclination > MOVED and turned < UNMOVED:
            yield ImuFinding(
                (segment,),
                f"the sensor of {segment} does not move ({np.degrees(turned):.0f} deg, the segment "
                f"{np.degrees(inclination):.0f} deg): strap it on, or check whether it is stuck",
            )


class Phase(Enum):
    """Phase of the calibration."""

    STAND = "stand"
    MOVE = "move"
    DONE = "done"


@dataclass(frozen=True, kw_only=True)
class ImuCalibrationResult:
    """Alignment of all sensors, with faults and remarks."""

    alignments: SensorsToSegments
    faults: Sequence[ImuFinding]
    remarks: Sequence[ImuFinding]

    @property
    def usable(self) -> SensorsToSegments:
        """The alignments of sensors without a fault."""
        at_fault = _segments_of(self.faults)
        return {name: each for name, each in self.alignments.items() if name not in at_fault}


class ImuCalibration:
    """Collects samples of cameras and IMUs until the alignments are certain enough.

    Args:
        parameters: See :class:`ImuCalibrationParameters`.
        extrinsics: Poses of the Kinects.

    Raises:
        CalibrationError: If a required segment is not part of the body model.
    """

    def __init__(self, parameters: ImuCalibrationParameters, extrinsics: Extrinsics) -> None:
        model = load_body_model("default")
        strange = [name for name in parameters.worn if name not in model.segments]
        if strange:
            raise CalibrationError(
                f"worn names {', '.join(strange)}: no camera sees such a segment, expected some of "
                f"{', '.join(name for name in SEGMENTS if name in model.segments)}"
            )
        self.parameters = parameters
        self.recorder = ObservationRecorder(
            parameters.sensors, extrinsics, model, parameters.tracker_delay
        )
        self.phase = Phase.STAND
        self.result: ImuCalibrationResult | None = None
        self._attempt_at_s = parameters.minimum_duration
        self._missing, self._progress = "", 0.0

    def use_clocks(self, clocks: Clocks) -> None:
        """Use these clocks for later samples."""
        self.recorder.clocks = dict(clocks)

    def add(self, sample: SkeletonSample | ImuBlock) -> None:
        """Add a sample."""
        if self.phase is Phase.DONE:
            return
        if isinstance(sample, ImuBlock):
            self.recorder.add_imu(sample)
            return
        self.recorder.add_skeleton(sample)
        if self.recorder.stand is None:
            return
        self.phase = Phase.MOVE
        if self.recorder.moved_s >= self._attempt_at_s:
            self._attempt_at_s += ATTEMPT_EVERY_S
            self.solve()

    def solve(self) -> None:
        """Estimate the alignments from the samples so far; done if they are certain enough."""
        observations = self.recorder.observations()
        if observations is None:
            return
        explanations = explain(observations)
        alignments = fit_alignments(observations)
        enough = self.parameters.enough_stddev
        self.result = ImuCalibrationResult(
            alignments=alignments,
            faults=[*faults_of(observations, explanations), *self._absent()],
            remarks=[*remarks_on(alignments), *uncertain(alignments, enough)],
        )
        self._missing, self._progress = what_is_missing(
            self.result.usable, explanations.alike, enough
        )
        if not self._missing or self.recorder.moved_s >= self.parameters.collect_duration:
            self.phase = Phase.DONE

    def finish(self) -> ImuCalibrationResult:
        """The result from all samples, at the end of the recording or of the time.

        Raises:
            CalibrationError: If there was no N-pose, or too little motion after it.
        """
        if self.phase is not Phase.DONE:
            self.solve()
        moved_s, least_s = self.recorder.moved_s, self.parameters.minimum_duration
        if self.result is None:
            raise CalibrationError(
                f"found no N-pose: {self.missing}; without one './pose fuse' and the fusion align "
                "the IMUs from motion"
            )
        if moved_s < least_s:
            raise CalibrationError(
                f"found {moved_s:.1f} s after the N-pose, expected {least_s:.1f} s of "
                "motion or more: move for longer before the cameras"
            )
        return self.result

    @property
    def progress(self) -> float:
        """Progress of the calibration, 0 to 1."""
        if self.phase is Phase.STAND:
            return 0.0
        return 1.0 if self.phase is Phase.DONE else STOOD + (1.0 - STOOD) * self._progress

    @property
    def missing(self) -> str:
        """Instruction to the person; empty if there is none."""
        if self.phase is Phase.DONE:
            return ""
        if self.phase is Phase.STAND:
            return self._missing_for_n_pose()
        if self.result is not None and self.result.faults:
            return self.result.faults[0].text
        return self._missing or "move: raise the arms, bend the elbows, lift the knees, turn, lean"

    def _missing_for_n_pose(self) -> str:
        recorder = self.recorder
        absent = [name for name in self.parameters.worn if name not in recorder.segments]
        if not recorder.segments or absent:
            return f"no orientation yet from the IMU of {', '.join(absent) or 'any segment'}"
        reason = recorder.posture()
        if not reason and not recorder.is_still:
            reason = "you, or a sensor, still move"
        return f"{STAND} ({reason})" if reason else STAND

    def _absent(self) -> list[ImuFinding]:
        return [
            ImuFinding(
                (name,), f"no samples from {name}: check its cable or radio, and the nodes file"
            )
            for name in self.parameters.worn
            if name not in self.recorder.segments
        ]
