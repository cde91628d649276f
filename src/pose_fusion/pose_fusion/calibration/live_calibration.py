"""Calibration while the person moves: a first solution soon, one refinement later."""

from collections.abc import Sequence
from enum import Enum

from pose_common.counters import Counters
from pose_fusion.calibration.extrinsics import Extrinsics
from pose_fusion.calibration.extrinsics_calibration import ExtrinsicsCalibrator
from pose_fusion.calibration.parameters import LiveCalibrationParameters
from pose_fusion.calibration.rigid_transform import CalibrationError
from pose_fusion.streams.samples import SkeletonSample
from pose_fusion.streams.single_person import SinglePersonSelector
from pose_fusion.streams.time_alignment import TimeAligner

ATTEMPT_EVERY_S = 1.0  # [s] of common view


class CalibrationState(Enum):
    """How far the calibration is."""

    COLLECTING = "collecting"
    CALIBRATED = "calibrated"  # and still collecting, for the refinement
    REFINED = "refined"
    LOADED = "loaded"  # from a file


class LiveCalibration:
    """Collects skeletons and says when there is a new calibration.

    The first solution comes as soon as ``minimum_duration`` of common view determines the
    sensors' places; after ``collect_duration`` it is refined once with all that was seen, and then
    stays until :meth:`restart`.

    Args:
        parameters: See the class.
        known: A calibration to keep instead of finding one.
    """

    def __init__(
        self, parameters: LiveCalibrationParameters, known: Extrinsics | None = None
    ) -> None:
        self.parameters = parameters
        self.extrinsics = known
        self.state = CalibrationState.COLLECTING if known is None else CalibrationState.LOADED
        self.counters = Counters("solutions", "refused_solutions")
        self.selector = SinglePersonSelector(parameters.person)
        self._begin()

    def restart(self) -> None:
        """Forget what was seen and find a new calibration; the old one holds until then."""
        self.state = CalibrationState.COLLECTING
        self._begin()

    def _begin(self) -> None:
        parameters = self.parameters
        self.aligner = TimeAligner(
            parameters.sensors,
            max_skew_s=parameters.max_skew,
            max_gap_s=parameters.max_gap,
            max_wait_s=parameters.max_wait,
        )
        self.calibrator = ExtrinsicsCalibrator(
            parameters.sensors, parameters.limits, parameters.known_mounting
        )
        self._attempt_at_s = parameters.minimum_duration
        self._refusal = ""

    @property
    def status(self) -> str:
        """The state, for people: what is missing, or what was reached."""
        if self.state is not CalibrationState.COLLECTING:
            residuals = {} if self.extrinsics is None else self.extrinsics.residuals
            reached = [
                f"{name} within {pair.median * 100.0:.1f} cm ({pair.raw_median * 100.0:.1f} cm "
                "uncalibrated)"
                for name, pair in residuals.items()
            ]
            return f"{self.state.value}: {', '.join(reached)}" if reached else self.state.value
        if self._refusal:
            return f"collecting: {self._refusal}"
        silent = [name for name in self.parameters.sensors if not self.aligner.has_heard(name)]
        if silent:
            return f"collecting: no skeletons from {', '.join(silent)} yet"
        return (
            f"collecting: {self.calibrator.observed_s:.1f} s of common view, expected "
            f"{self.parameters.minimum_duration:.1f} s or more"
        )

    def add(self, persons: Sequence[SkeletonSample]) -> Extrinsics | None:
        """Take all that a sensor saw in one frame; returns a new calibration, if this gives one."""
        if self.state in (CalibrationState.REFINED, CalibrationState.LOADED):
            return None
        sample = self.selector.select(persons)
        if sample is None:
            return None
        for frame in self.aligner.add(sample):
            self.calibrator.add(frame)
        if self.calibrator.observed_s < self._attempt_at_s:
            return None
        return self._attempt()

    def _attempt(self) -> Extrinsics | None:
        self._attempt_at_s = self.calibrator.observed_s + ATTEMPT_EVERY_S
        try:
            self.extrinsics = self.calibrator.solve()
        except CalibrationError as error:
            self.counters.add("refused_solutions")
            self._refusal = str(error)
            return None
        self.counters.add("solutions")
        self._refusal = ""
        if self.calibrator.observed_s >= self.parameters.collect_duration:
            self.state = CalibrationState.REFINED
        else:
            self.state = CalibrationState.CALIBRATED
            self._attempt_at_s = self.parameters.collect_duration
        return self.extrinsics
