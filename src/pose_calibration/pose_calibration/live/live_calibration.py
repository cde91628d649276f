"""Live calibration while the person moves: a first solution, its refinement, and monitoring."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum

from pose_calibration.floor.gravity import AccelerometerGravity
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.live.clock_tracking import ClockTracker
from pose_calibration.live.collection import COUNTERS, Collection
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_calibration.live.watchdog import Moved, Watchdog
from pose_calibration.people.calibration_person import CalibrationPerson
from pose_core.api import (
    Clocks,
    Extrinsics,
    RepeatedFrames,
    SkeletonSample,
    moved_most_ns,
    on_reference_clock,
)
from pose_core.counters import Counters

IMU_REACH_NS = 90_000_000_000  # [ns] duration of stored IMU samples
CHANGED_NS = 500_000  # [ns] change from which on a clock is published again


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
        self._moved_meanwhile: Moved | None = None  # before the last solution; it was refused
        self._awaits_final = False  # whether no solution before the last one is used
        self.selector = CalibrationPerson(parameters.sensors, parameters.person)
        self._counters = Counters(*COUNTERS, "moves_noticed", "frames_repeated")
        self._repeated = RepeatedFrames()
        self.accelerometer = AccelerometerGravity()
        self.imu_memory = ImuMemory(IMU_REACH_NS)
        self._begin()
        if known is not None:
            self._watch(known, Watchdog(known))

    def restart(self, *, until_final: bool = False) -> None:
        """Drop all samples and estimate a new calibration; the old one is valid until then.

        Args:
            until_final: Whether it is valid until the new one is final, since the first solutions
                may be worse: it had been refined before.
        """
        self.state = CalibrationState.CALIBRATED if until_final else CalibrationState.COLLECTING
        self._awaits_final, self._moved_meanwhile = until_final, None
        self.selector.restart()
        self._begin()

    def restart_time(self) -> None:
        """Handle restarted stamps, as when a bag loops: drop all samples, keep the calibration."""
        self.restart()
        if self.extrinsics is not None:
            self.state = CalibrationState.LOADED
            self._watch(self.extrinsics, Watchdog(self.extrinsics))

    def _begin(self) -> None:
        self.collection = Collection(
            self.parameters, self.accelerometer, self.imu_memory, self._counters
        )
        self._monitors: tuple[ClockTracker, Watchdog] | None = None  # after the calibration
        self._new_clocks: Clocks | None = None

    @property
    def is_finished(self) -> bool:
        """Whether the collection has ended."""
        return self.state in (CalibrationState.REFINED, CalibrationState.LOADED)

    @property
    def progress(self) -> float:
        """Progress of the calibration, 0 to 1."""
        return 1.0 if self.is_finished else self.collection.progress

    @property
    def missing(self) -> str:
        """Instruction to the person; empty if there is none."""
        if self.is_finished:
            return ""
        if self.selector.missing:
            return self.selector.missing
        if self.state is CalibrationState.CALIBRATED:
            return self.collection.advice
        return self.collection.waits_for

    @property
    def moved(self) -> Moved | None:
        """A sensor that has been moved, until the views agree again or the next solution."""
        return self._moved_meanwhile if self._monitors is None else self._monitors[1].moved

    @property
    def displacement(self) -> Mapping[str, float]:
        """Displacement of each view from the others [m], since the calibration."""
        return {} if self._monitors is None else self._monitors[1].displacement

    @property
    def counts(self) -> dict[str, int]:
        """Counts of measurements, solutions and rejected samples by name."""
        frames_with = self.collection.calibrator.frames_with.items()
        return {
            **{f"frames_with/{sensor}": count for sensor, count in frames_with},
            "accelerometer_readings": self.accelerometer.readings,
            "accelerometer_left_out": self.accelerometer.left_out,
            **self._counters.as_dict(),
            **self.selector.counters.as_dict("person/"),
            **self.collection.aligner.counters.as_dict("alignment/"),
        }

    @property
    def status(self) -> str:
        """The state as a sentence: what is missing, or the accuracy reached."""
        if self.state is CalibrationState.COLLECTING:
            if self.selector.is_waiting:
                return "collecting: several people are detected, searching one whose views agree"
            again = f" again, {self.moved}" if self.moved else ""
            return f"collecting{again}: {self.missing}"
        if self.moved is not None:
            return f"{self.state.value}, but {self.moved}: calibrate again"
        residuals = {} if self.extrinsics is None else self.extrinsics.residuals
        reached = [
            f"{name} within {pair.median * 100.0:.1f} cm ({pair.raw_median * 100.0:.1f} cm "
            "uncalibrated)"
            for name, pair in residuals.items()
        ]
        text = f"{self.state.value}: {', '.join(reached)}" if reached else self.state.value
        return f"{text}; {self.missing}" if self.missing else text

    def take_clocks(self) -> Clocks | None:
        """The clocks, once after each change; None without a change."""
        clocks, self._new_clocks = self._new_clocks, None
        return clocks

    def add(self, persons: Sequence[SkeletonSample]) -> Extrinsics | None:
        """Add all persons of one sensor's frame; returns the calibration if it is new."""
        if self.is_finished and not self.parameters.watch:
            return None
        if persons and self._repeated.is_frozen(persons[0].sensor, persons):
            self._counters.add("frames_repeated")
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
        found = self.collection.add(sample)
        if found is None:
            return None
        watchdog = Watchdog(found)
        if self.parameters.watch:
            moved = watchdog.moved_in(self.collection.frames)
            if moved is not None:
                self._restart_after(moved)
                return None
        if self._awaits_final and not self.collection.is_complete:
            return None
        self.extrinsics, self._moved_meanwhile = found, None
        self.state = CalibrationState.CALIBRATED
        if self.collection.is_complete:
            self.state = CalibrationState.REFINED
            self._watch(found, watchdog)
        return found

    def _restart_after(self, moved: Moved) -> None:
        """Restart since a sensor was moved: no poses fit the samples before and after it."""
        self._counters.add("moves_noticed")
        self.restart()
        self._moved_meanwhile = moved

    def _watch(self, extrinsics: Extrinsics, watchdog: Watchdog) -> None:
        """Monitor from now on; the watchdog may know the frames of the calibration."""
        self.collection.use_clocks(extrinsics.clocks)
        self.selector.use_extrinsics(extrinsics)
        if self.parameters.watch:
            clock_tracker = ClockTracker(extrinsics, self.parameters.max_offset)
            self._monitors = clock_tracker, watchdog
            self._new_clocks = None

    def _monitor(self, sample: SkeletonSample) -> None:
        """Track the sources' clocks and compare the views, until the next calibration."""
        if self._monitors is None or self.extrinsics is None:
            return
        clock_tracker, watchdog = self._monitors
        clocks, known = clock_tracker.add(sample, self.imu_memory), self.extrinsics.clocks
        if clocks is not None and moved_most_ns(known, clocks, sample.stamp_ns) > CHANGED_NS:
            self._new_clocks = dict(clocks)
            self.extrinsics = replace(self.extrinsics, clocks=self._new_clocks)
        frames = self.collection.aligner.add(on_reference_clock(sample, self.extrinsics.clocks))
        noticed = [moved for moved in map(watchdog.add, frames) if moved]
        if noticed and self.parameters.recalibrate_when_moved:
            self._restart_after(noticed[-1])
        elif noticed:
            self._counters.add("moves_noticed")
