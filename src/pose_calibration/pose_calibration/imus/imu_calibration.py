"""Sensor-to-segment calibration of IMUs, live and offline: the fusion itself, until it is certain.

The alignments are those that the default estimator finds from any motion that the cameras see.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.imus.guidance import how_to_move
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_core.api import (
    Extrinsics,
    ImuBlock,
    ImuUse,
    Pipeline,
    PipelineParameters,
    SensorsToSegments,
    SensorToSegment,
    SkeletonSample,
)
from pose_core.joints import SEGMENTS
from pose_core.stamps import NS_PER_S

UPDATE_NS = NS_PER_S  # [ns] time between two updates of the progress
NO_POSE = "no pose yet: stand in view of the cameras"


@dataclass(frozen=True, kw_only=True)
class ImuCalibrationResult:
    """Alignments of all sensors without a fault."""

    alignments: SensorsToSegments
    uses: Sequence[ImuUse]  # state of each sensor with samples
    faults: Sequence[str]  # what is wrong with a sensor, and what to do


class ImuCalibration:
    """Passes samples of cameras and IMUs to a pipeline until the alignments are certain enough.

    Args:
        parameters: See :class:`ImuCalibrationParameters`.
        extrinsics: Poses of the Kinects.

    Raises:
        CalibrationError: If a required segment is not part of the body model.

    Attributes:
        is_done: Whether samples are no longer needed.
        progress: Progress of the calibration, 0 to 1.
        missing: Instruction to the person; empty if there is none.
    """

    def __init__(self, parameters: ImuCalibrationParameters, extrinsics: Extrinsics) -> None:
        self.parameters = parameters
        self.pipeline = Pipeline(
            PipelineParameters(
                sensors=parameters.sensors, tracker_delay=parameters.tracker_delay, output_rate=0.0
            ),
            extrinsics,
        )
        segments = self.pipeline.model.segments
        strange = [name for name in parameters.worn if name not in segments]
        if strange:
            raise CalibrationError(
                f"worn names {', '.join(strange)}: no camera sees such a segment, expected some of "
                f"{', '.join(name for name in SEGMENTS if name in segments)}"
            )
        self.is_done, self.progress, self.missing = False, 0.0, self._absent() or NO_POSE
        self._begin_ns: int | None = None
        self._update_ns = 0

    def add(self, sample: SkeletonSample | ImuBlock) -> None:
        """Add a sample."""
        if self.is_done:
            return
        estimates = self.pipeline.add(sample)
        if self._begin_ns is None:
            self.missing = self._absent() or NO_POSE
        if estimates and self._begin_ns is None:
            self._begin_ns = self._update_ns = estimates[0].stamp_ns
        if estimates and estimates[-1].stamp_ns >= self._update_ns:
            self._update_ns = estimates[-1].stamp_ns + UPDATE_NS
            self._update_progress()

    def finish(self) -> ImuCalibrationResult:
        """The result from all samples.

        Raises:
            CalibrationError: If the person has moved in view of the cameras for too short a time.
        """
        self.pipeline.flush()
        moved_s, least_s = self._moved_s(), self.parameters.minimum_duration
        if moved_s < least_s:
            raise CalibrationError(
                f"found {moved_s:.1f} s with a pose, expected {least_s:.1f} s of motion or more: "
                "move for longer before the cameras"
            )
        uses = self.pipeline.imu_uses
        sound = [use for use in uses if not (use.reason or use.exchanged_with)]
        at_fault = [use for use in uses if use.reason or use.exchanged_with]
        found = self.pipeline.sensor_to_segment
        return ImuCalibrationResult(
            alignments={use.segment: _as_stated(found[use.segment], use) for use in sound},
            uses=uses,
            faults=[*map(_fault, at_fault), *filter(None, [self._absent()])],
        )

    def _moved_s(self) -> float:
        begin_ns = self._begin_ns
        return 0.0 if begin_ns is None else (self.pipeline.newest_ns - begin_ns) / NS_PER_S

    def _absent(self) -> str:
        """What to do about sensors that must be worn but send nothing."""
        imus = self.pipeline.imus.segments
        absent = [name for name in self.parameters.worn if name not in imus]
        if imus and not absent:
            return ""
        who = ", ".join(absent) or "any segment"
        return f"no samples from the IMU of {who}: check its cable or radio, and the nodes file"

    def _update_progress(self) -> None:
        """Find out how far the calibration is and what the person should do next."""
        enough, shares = self.parameters.enough_stddev, {}
        uses = {use.segment: use for use in self.pipeline.imu_uses}
        for name, use in uses.items():
            stddev = np.inf if use.reason else max(use.tilt_stddev, use.turn_stddev)
            shares[name] = min(1.0, enough / stddev)
        absent, moved_s = self._absent(), self._moved_s()
        waited = min(1.0, moved_s / self.parameters.minimum_duration)
        self.progress = float(np.mean([*shares.values(), waited]))
        worst = min(shares, key=lambda name: shares[name], default="")
        is_certain = worst and shares[worst] == 1.0 and not absent
        self.is_done = moved_s >= self.parameters.collect_duration or bool(
            is_certain and waited == 1.0
        )
        if self.is_done:
            self.progress, self.missing = 1.0, ""
        elif absent or is_certain or not worst:
            self.missing = absent or "move: raise the arms, bend the elbows, lift the knees, turn"
        else:
            self.missing = f"{how_to_move(worst)} ({uses[worst]})"


def _as_stated(alignment: SensorToSegment, use: ImuUse) -> SensorToSegment:
    """With the stated deviations: trackers' offsets differ in another session."""
    tilt, turn = use.tilt_stddev, use.turn_stddev
    return replace(alignment, stddev=np.array([tilt, tilt, turn]))


def _fault(use: ImuUse) -> str:
    return f"IMU {use.segment}: {use.reason or use.remark}"
