"""Live calibration while the person moves: a first solution, its refinement, and monitoring."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum

from pose_calibration.body_measures import measure_body
from pose_calibration.clocks.clock_offset import ClockOffset, estimate_clock_offsets
from pose_calibration.extrinsics.extrinsics_calibration import ExtrinsicsCalibrator
from pose_calibration.floor.gravity import AccelerometerGravity
from pose_calibration.inertial.imu_clock import ImuFindings, imu_findings
from pose_calibration.inertial.imu_motion import ImuMemory
from pose_calibration.live.guidance import what_is_missing
from pose_calibration.live.monitoring import Monitoring
from pose_calibration.live.sample_memory import SampleMemory
from pose_calibration.live.watchdog import Moved
from pose_calibration.parameters import LiveCalibrationParameters
from pose_calibration.people.calibration_person import CalibrationPerson
from pose_calibration.rigid_transform import CalibrationError
from pose_core.api import (
    IMUS,
    Clocks,
    Extrinsics,
    FloatArray,
    ImuBlock,
    SkeletonSample,
    TimeAligner,
    moved_most_ns,
    on_reference_clock,
)
from pose_core.counters import Counters

ATTEMPT_EVERY_S = 1.0  # [s] of common view
NEXT_AFTER = 2.0  # [-] ratio of the common view between successive solutions
NEXT_WITHIN_S = 8.0  # [s] largest common view between successive solutions
SAME_OFFSET_NS = 2_000_000  # [ns] smaller changes are ignored
IMU_REACH_NS = 90_000_000_000  # [ns] duration of stored IMU samples


class CalibrationState(Enum):
    """State of the calibration."""

    COLLECTING = "collecting"
    CALIBRATED = "calibrated"  # still collecting, for the refinement
    REFINED = "refined"
    LOADED = "loaded"  # from a file


class LiveCalibration:
    """Collects skeletons until they determine a calibration.

    The first solution follows as soon as ``minimum_duration`` of common view determines the
    sensors' poses and clocks. It is refined each time the common view has doubled, until it is
    certain enough or ``collect_duration`` is over. Sensors without common view are added
    later. From then on it is monitored until :meth:`restart`.

    Args:
        parameters: See :class:`LiveCalibrationParameters`.
        known: A calibration to use instead of estimating one.
    """

    def __init__(
        self, parameters: LiveCalibrationParameters, known: Extrinsics | None = None
    ) -> None:
        self.parameters = parameters
        self.extrinsics = known
        self.state = CalibrationState.COLLECTING if known is None else CalibrationState.LOADED
        self.selector = CalibrationPerson(parameters.sensors, parameters.person)
        self._counters = Counters("solutions", "refused_solutions", "moves_noticed")
        self._accelerometer = AccelerometerGravity()
        self._imu_memory = ImuMemory(IMU_REACH_NS)
        self._begin()
        if known is not None:
            self._watch(known)

    def restart(self) -> None:
        """Drop all samples and estimate a new calibration; the old one is valid until then."""
        self.state = CalibrationState.COLLECTING
        self.selector.restart()
        self._begin()

    def restart_time(self) -> None:
        """Handle restarted stamps, as when a bag loops: drop all samples, keep the calibration."""
        self.restart()
        if self.extrinsics is not None:
            self.state = CalibrationState.LOADED
            self._watch(self.extrinsics)

    def _begin(self) -> None:
        self.clock_offsets: dict[str, ClockOffset] = {}
        self.imus: ImuFindings | None = None
        self._memory = SampleMemory()
        self._use_clocks({})
        self._attempt_at_s = self.parameters.minimum_duration
        self._refusal = ""
        self._missing, self._progress = "", 0.0
        self._monitoring: Monitoring | None = None

    def _use_clocks(self, clocks: Clocks) -> None:
        """Align by these clocks from now on, and realign the stored samples."""
        parameters = self.parameters
        self._clocks = clocks
        self._aligner = TimeAligner(
            parameters.sensors,
            max_skew_s=parameters.max_skew,
            max_gap_s=parameters.max_gap,
            max_wait_s=parameters.max_wait,
        )
        self._calibrator = ExtrinsicsCalibrator(
            parameters.sensors, parameters.limits, parameters.known_mounting
        )
        for frame in self._memory.aligned(self._aligner, clocks):
            self._calibrator.add(frame)

    @property
    def is_finished(self) -> bool:
        """Whether the collection has ended."""
        return self.state in (CalibrationState.REFINED, CalibrationState.LOADED)

    @property
    def progress(self) -> float:
        """Progress of the calibration, 0 to 1."""
        return 1.0 if self.is_finished else self._progress

    @property
    def missing(self) -> str:
        """Instruction to the person; empty if there is none."""
        if self.is_finished:
            return ""
        if self.state is CalibrationState.CALIBRATED:
            return self._missing
        if self._refusal:
            return self._refusal
        silent = [name for name in self.parameters.sensors if not self._aligner.has_heard(name)]
        if silent:
            return f"no skeletons from {', '.join(silent)} yet"
        return (
            f"{self._calibrator.observed_s:.1f} s of common view, expected "
            f"{self.parameters.minimum_duration:.1f} s or more"
        )

    @property
    def moved(self) -> Moved | None:
        """A sensor that has been moved since the calibration."""
        return None if self._monitoring is None else self._monitoring.moved

    @property
    def displacement(self) -> Mapping[str, float]:
        """Displacement of each view from the others [m], since the calibration."""
        return {} if self._monitoring is None else self._monitoring.displacement

    @property
    def common_view_s(self) -> float:
        """Common view [s] collected so far."""
        return self._calibrator.observed_s

    @property
    def imu_segments(self) -> tuple[str, ...]:
        """Segments whose IMU sends samples."""
        return self._imu_memory.segments

    @property
    def counts(self) -> dict[str, int]:
        """Counts of measurements, solutions and rejected samples by name."""
        frames_with = self._calibrator.frames_with.items()
        return {
            **{f"frames_with/{sensor}": count for sensor, count in frames_with},
            "accelerometer_readings": self._accelerometer.readings,
            "accelerometer_left_out": self._accelerometer.left_out,
            **self._counters.as_dict(),
            **self.selector.counters.as_dict("person/"),
            **self._aligner.counters.as_dict("alignment/"),
        }

    @property
    def status(self) -> str:
        """The state as a sentence: what is missing, or the accuracy reached."""
        if self.moved is not None:
            return f"{self.state.value}, but {self.moved}: calibrate again"
        if self.state is CalibrationState.COLLECTING:
            if self.selector.is_waiting:
                return "collecting: several people are detected, searching one whose views agree"
            return f"collecting: {self.missing}"
        residuals = {} if self.extrinsics is None else self.extrinsics.residuals
        reached = [
            f"{name} within {pair.median * 100.0:.1f} cm ({pair.raw_median * 100.0:.1f} cm "
            "uncalibrated)"
            for name, pair in residuals.items()
        ]
        text = f"{self.state.value}: {', '.join(reached)}" if reached else self.state.value
        return f"{text}; {self.missing}" if self.missing else text

    def add_acceleration(self, acceleration: FloatArray) -> None:
        """Add a measurement of the reference's accelerometer, (3,) [m/s²] in its optical frame."""
        self._accelerometer.add(acceleration)

    def add_imus(self, block: ImuBlock) -> None:
        """Add samples of body-worn IMUs."""
        self._imu_memory.add(block)

    def take_clocks(self) -> Clocks | None:
        """The clocks, once after each change; None without a change."""
        return None if self._monitoring is None else self._monitoring.take_clocks()

    def add(self, persons: Sequence[SkeletonSample]) -> Extrinsics | None:
        """Add all persons of one sensor's frame; returns the calibration if it is new."""
        if self.is_finished and not self.parameters.watch:
            return None
        samples = self.selector.select(persons)
        if persons and self.selector.is_waiting:
            samples = self.selector.match(persons[0].stamp_ns)
            if samples and not self.is_finished:
                self._begin()  # restart with one person's samples: identities were unknown
        given = [self._add(sample) for sample in samples]
        return next((each for each in reversed(given) if each is not None), None)

    def _add(self, sample: SkeletonSample) -> Extrinsics | None:
        """Add a sample of the person."""
        if self.is_finished:
            self._monitor(sample)
            return None
        self._memory.add(sample)
        for frame in self._aligner.add(on_reference_clock(sample, self._clocks)):
            self._calibrator.add(frame)
        if self._calibrator.observed_s < self._attempt_at_s:
            return None
        return self._attempt()

    def _watch(self, extrinsics: Extrinsics) -> None:
        self._use_clocks(extrinsics.clocks)
        self.selector.place_sensors(extrinsics)
        if self.parameters.watch:
            self._monitoring = Monitoring(extrinsics, self._aligner, self.parameters.max_offset)

    def _monitor(self, sample: SkeletonSample) -> None:
        if self._monitoring is None:
            return
        is_moved = self._monitoring.add(sample, self._imu_memory)
        self.extrinsics = self._monitoring.extrinsics
        if is_moved:
            self._counters.add("moves_noticed")
            if self.parameters.recalibrate_when_moved:
                self.restart()

    def _attempt(self) -> Extrinsics | None:
        observed_s = self._calibrator.observed_s
        self._attempt_at_s = observed_s + ATTEMPT_EVERY_S
        try:
            found = self._solve()
            if self._find_clocks():
                found = self._solve()
        except CalibrationError as error:
            self._counters.add("refused_solutions")
            self._refusal = str(error)
            return None
        self._counters.add("solutions")
        self._refusal = ""
        clocks = {name: self._clocks[name] for name in found.sensors if name in self._clocks}
        self.extrinsics = self._with_imus(replace(found, clocks=clocks))
        self._conclude(self.extrinsics, observed_s)
        return self.extrinsics

    def _solve(self) -> Extrinsics:
        return self._calibrator.solve(allow_missing=True, gravity=self._accelerometer.gravity())

    def _with_imus(self, extrinsics: Extrinsics) -> Extrinsics:
        """Add the results of body-worn IMUs to the calibration, if there are any."""
        if not self._imu_memory.segments:
            return extrinsics
        by_sensor = self._memory.by_sensor()
        skeletons = {name: by_sensor[name] for name in extrinsics.sensors if name in by_sensor}
        limit_s = self.parameters.max_offset
        self.imus = imu_findings(extrinsics, skeletons, self._imu_memory, limit_s)
        clocks = dict(extrinsics.clocks)
        if self.imus.clock is not None:
            clocks[IMUS] = self.imus.clock
        if self.imus.gravity is not None and self._accelerometer.gravity() is None:
            extrinsics = self._calibrator.leveled(extrinsics, self.imus.gravity)
        self._clocks = clocks
        return replace(extrinsics, clocks=clocks)

    def _conclude(self, extrinsics: Extrinsics, observed_s: float) -> None:
        """Decide whether that was the last solution."""
        parameters = self.parameters
        self._missing, self._progress = what_is_missing(
            extrinsics,
            self._calibrator.memory.frames(),
            parameters.sensors,
            parameters.enough_rotation_stddev,
            parameters.enough_position_stddev,
        )
        complete = set(extrinsics.sensors) == set(parameters.sensors)
        if complete and (not self._missing or observed_s >= parameters.collect_duration):
            self.state = CalibrationState.REFINED
            by_sensor = self._memory.by_sensor()
            samples = [one for name in extrinsics.sensors for one in by_sensor.get(name, [])]
            self.extrinsics = replace(extrinsics, body=measure_body(samples))
            self._memory.clear()
            self._watch(self.extrinsics)
        else:
            self.state = CalibrationState.CALIBRATED
            later_s = max(parameters.collect_duration, observed_s + ATTEMPT_EVERY_S)
            next_s = min(NEXT_AFTER * observed_s, observed_s + NEXT_WITHIN_S)
            self._attempt_at_s = min(next_s, later_s)

    def _find_clocks(self) -> bool:
        """Estimate the clocks' offsets; returns whether the alignment in time has changed."""
        parameters = self.parameters
        self.clock_offsets, clocks = estimate_clock_offsets(
            self._memory.by_sensor(), parameters.sensors, parameters.max_offset
        )
        changed = moved_most_ns(self._clocks, clocks, self._memory.newest_ns) > SAME_OFFSET_NS
        if changed:
            self._use_clocks(clocks)
        return changed
