"""The IMUs' calibration, live and offline: stand, move, done."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from pose_calibration.imus.alignment_fit import fit_alignments
from pose_calibration.imus.explaining import explain
from pose_calibration.imus.findings import Finding, faults_of, remarks_on, uncertain
from pose_calibration.imus.guidance import what_is_missing
from pose_calibration.imus.observations import ObservationRecorder
from pose_calibration.imus.parameters import ImuCalibrationParameters
from pose_calibration.rigid_transform import CalibrationError
from pose_core.api import Extrinsics, ImuBlock, SensorsToSegments, SkeletonSample, load_body_model
from pose_core.joints import SEGMENTS

ATTEMPT_EVERY_S = 2.0  # [s] of motion
STOOD = 0.2  # [-] of the progress that the N-pose is
STAND = "stand still, upright, arms hanging, palms to the thighs, for 2 s"


class Phase(Enum):
    """What the person does."""

    STAND = "stand"
    MOVE = "move"
    DONE = "done"


@dataclass(frozen=True, kw_only=True)
class ImuCalibrationResult:
    """Alignment of all sensors, with faults and remarks."""

    alignments: SensorsToSegments
    faults: Sequence[Finding]
    remarks: Sequence[Finding]

    @property
    def usable(self) -> SensorsToSegments:
        """The alignments of sensors without a fault."""
        at_fault = {segment for fault in self.faults for segment in fault.segments}
        return {name: each for name, each in self.alignments.items() if name not in at_fault}


class ImuCalibration:
    """Collects samples of cameras and IMUs until the alignments are known well enough.

    Args:
        parameters: See the class.
        extrinsics: Where the Kinects are.

    Raises:
        CalibrationError: If a segment that must be worn is none of the body's.
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
        is_over = self.recorder.moved_s >= self.parameters.collect_duration
        if not self._missing or is_over:
            self.phase = Phase.DONE

    def finish(self) -> ImuCalibrationResult:
        """The result of all there was: the recording has ended, or the time is up.

        Raises:
            CalibrationError: If the person did not stand neutrally, or did not move long enough.
        """
        if self.phase is not Phase.DONE:
            self.solve()
        moved_s, least_s = self.recorder.moved_s, self.parameters.minimum_duration
        if self.result is None:
            raise CalibrationError(f"found no N-pose: {self.missing}")
        if moved_s < least_s:
            raise CalibrationError(
                f"found {moved_s:.1f} s after the N-pose, expected {least_s:.1f} s of "
                "motion or more: move for longer before the cameras"
            )
        return self.result

    @property
    def progress(self) -> float:
        """How much of what is wanted has been seen, 0 to 1."""
        if self.phase is Phase.STAND:
            return 0.0
        return 1.0 if self.phase is Phase.DONE else STOOD + (1.0 - STOOD) * self._progress

    @property
    def missing(self) -> str:
        """What the person should do now; empty if nothing."""
        if self.phase is Phase.DONE:
            return ""
        if self.phase is Phase.STAND:
            return self._missing_for_n_pose()
        faults = [] if self.result is None else self.result.faults
        if faults:
            return faults[0].text
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

    def _absent(self) -> list[Finding]:
        return [
            Finding(
                segments=(name,),
                text=f"no IMU was heard on {name}: look at its cable or radio, and the nodes file",
                is_fault=True,
            )
            for name in self.parameters.worn
            if name not in self.recorder.segments
        ]
