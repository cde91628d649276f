"""Collection of samples until they determine a calibration: solutions, and what they still lack."""

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from operator import attrgetter

from pose_calibration.body_measures import measure_body
from pose_calibration.clocks.clock_offset import ClockOffset, estimate_clock_offsets
from pose_calibration.extrinsics.extrinsics_calibration import ExtrinsicsCalibrator
from pose_calibration.extrinsics.mirrored import refuse_mirrored
from pose_calibration.floor.gravity import AccelerometerGravity
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.inertial.imu_clock import ImuFindings, imu_findings
from pose_calibration.inertial.imu_memory import ImuMemory
from pose_calibration.live.guidance import what_is_missing
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.api import (
    AlignedFrame,
    Clocks,
    Extrinsics,
    SkeletonSample,
    TimeAligner,
    moved_most_ns,
    on_reference_clock,
)
from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S

COUNTERS = ("solutions", "refused_solutions")
ATTEMPT_EVERY_S = 1.0  # [s] of common view
NEXT_AFTER = 2.0  # [-] ratio of the common view between successive solutions
NEXT_WITHIN_S = 8.0  # [s] largest common view between successive solutions
SAME_OFFSET_NS = 2_000_000  # [ns] smaller changes are ignored
LONGEST = 4_000  # [samples] stored: a minute of two sensors
UNKNOWN_CLOCK_NS = 200_000_000  # [ns] between stamps that arrive together; networks delay by less


def by_sensor(samples: Iterable[SkeletonSample]) -> dict[str, list[SkeletonSample]]:
    """Each sensor's samples."""
    found: dict[str, list[SkeletonSample]] = {}
    for sample in samples:
        found.setdefault(sample.sensor, []).append(sample)
    return found


class Collection:
    """One person's samples from one start of the calibration on, and its solutions.

    Args:
        parameters: See :class:`LiveCalibrationParameters`.
        accelerometer: Measurements of the reference's accelerometer.
        imu_memory: Orientations of body-worn IMUs.
        counters: Counts the solutions; :data:`COUNTERS` are declared.
    """

    def __init__(
        self,
        parameters: LiveCalibrationParameters,
        accelerometer: AccelerometerGravity,
        imu_memory: ImuMemory,
        counters: Counters,
    ) -> None:
        self.clock_offsets: dict[str, ClockOffset] = {}  # of the last attempt, by sensor
        self.imus: ImuFindings | None = None  # of the last solution
        self.advice = ""  # what the last solution lacks, an instruction to the person
        self.progress = 0.0  # of the last solution, 0 to 1
        self.is_complete = False  # whether the last solution is final
        self._parameters = parameters
        self._accelerometer, self._imu_memory = accelerometer, imu_memory
        self._counters = counters
        self._memory: deque[SkeletonSample] = deque(maxlen=LONGEST)  # by their own clocks
        self._attempt_at_s = parameters.minimum_duration
        self._refusal = ""
        self._newest_ns: dict[str, int] = {}  # stamp of each sensor's last sample, by its clock
        self._apart: dict[str, tuple[int, int]] = {}  # [ns] see :meth:`_note_clock`
        self.use_clocks({})

    def use_clocks(self, clocks: Clocks) -> None:
        """Align by these clocks from now on, and realign the stored samples."""
        parameters = self._parameters
        self._clocks = clocks
        self.aligner = TimeAligner(
            parameters.sensors,
            max_skew_s=parameters.max_skew,
            max_gap_s=parameters.max_gap,
            # Before it is known, a clock may be behind the others' by max_offset.
            max_wait_s=parameters.max_wait + parameters.max_offset,
        )
        self.calibrator = ExtrinsicsCalibrator(parameters.sensors, parameters)
        self.frames: deque[AlignedFrame] = deque(maxlen=LONGEST)  # from the stored samples
        corrected = [on_reference_clock(sample, clocks) for sample in self._memory]
        for sample in sorted(corrected, key=attrgetter("stamp_ns")):
            self._add(sample)

    def _add(self, sample: SkeletonSample) -> None:
        """Add a sample with its stamp on the reference's clock."""
        for frame in self.aligner.add(sample):
            self.calibrator.add(frame)
            self.frames.append(frame)

    @property
    def waits_for(self) -> str:
        """What the first solution waits for, as an instruction to the person."""
        if self._refusal:
            return self._refusal
        silent = [name for name in self._parameters.sensors if not self.aligner.has_heard(name)]
        if silent:
            return f"no skeletons from {', '.join(silent)} yet"
        for name, (apart_ns, _) in self._apart.items():
            apart_s, limit_s = apart_ns / NS_PER_S, self._parameters.max_offset
            if abs(apart_s) > limit_s + self._parameters.max_wait:
                return (
                    f"{self._difference(name)}, more than max_offset = {limit_s} s: "
                    "synchronise the clocks of their computers, or raise max_offset"
                )
        return (
            f"{self.calibrator.memory.observed_s:.1f} s of common view, expected "
            f"{self._parameters.minimum_duration:.1f} s or more"
        )

    def _difference(self, name: str) -> str:
        """By how much a sensor's clock differs from the reference's, as far as arrival tells."""
        apart_s = self._apart[name][0] / NS_PER_S
        return (
            f"the clock of '{name}' is {abs(apart_s):.1f} s "
            f"{'ahead of' if apart_s > 0.0 else 'behind'} that of '{self._parameters.sensors[0]}'"
        )

    def _check_clocks(self) -> None:
        """Refuse a solution with clocks that differ by a time which the motion does not tell.

        Raises:
            CalibrationError: If there is such a clock.
        """
        for name, offset in self.clock_offsets.items():
            apart_ns, _ = self._apart.get(name, (0, 0))
            if not offset.observable and abs(apart_ns) > UNKNOWN_CLOCK_NS:
                raise CalibrationError(
                    f"{self._difference(name)}, but the motion does not tell by how much: walk "
                    "about and move the arms"
                )

    def _note_clock(self, sample: SkeletonSample) -> None:
        """Note how far a sensor's stamps are from the reference's that arrive at the same time.

        Each of the reference's stamps counts once, so that its silence is no difference of clocks.
        """
        self._newest_ns[sample.sensor] = sample.stamp_ns
        reference_ns = self._newest_ns.get(self._parameters.sensors[0])
        if reference_ns is None or sample.sensor == self._parameters.sensors[0]:
            return
        if self._apart.get(sample.sensor, (0, 0))[1] != reference_ns:
            self._apart[sample.sensor] = (sample.stamp_ns - reference_ns, reference_ns)

    def add(self, sample: SkeletonSample) -> Extrinsics | None:
        """Add a sample of the person; returns the calibration if it is solved anew."""
        self._note_clock(sample)
        self._memory.append(sample)
        self._add(on_reference_clock(sample, self._clocks))
        observed_s = self.calibrator.memory.observed_s
        if observed_s < self._attempt_at_s:
            return None
        self._attempt_at_s = observed_s + ATTEMPT_EVERY_S
        try:
            samples = by_sensor(self._memory)
            refuse_mirrored(samples)
            self.clock_offsets, clocks = estimate_clock_offsets(
                samples, self._parameters.sensors, self._parameters.max_offset
            )
            newest_ns = max(one.stamp_ns for one in self._memory)
            if moved_most_ns(self._clocks, clocks, newest_ns) > SAME_OFFSET_NS:
                self.use_clocks(clocks)
            self._check_clocks()
            found = self.calibrator.solve(allow_missing=True, gravity=self._accelerometer.gravity())
        except CalibrationError as error:
            self._counters.add("refused_solutions")
            self._refusal = str(error)
            return None
        self._counters.add("solutions")
        self._refusal = ""
        clocks = {name: self._clocks[name] for name in found.sensors if name in self._clocks}
        return self._conclude(self._with_imus(replace(found, clocks=clocks)), observed_s)

    def _with_imus(self, extrinsics: Extrinsics) -> Extrinsics:
        """Add the results of body-worn IMUs to the calibration, if there are any."""
        if not self._imu_memory.segments:
            return extrinsics
        samples = by_sensor(self._memory)
        skeletons = {name: samples[name] for name in extrinsics.sensors if name in samples}
        limit_s = self._parameters.max_offset
        self.imus = imu_findings(extrinsics, skeletons, self._imu_memory, limit_s)
        clocks = {**extrinsics.clocks, **self.imus.clocks}
        if self.imus.gravity is not None and self._accelerometer.gravity() is None:
            extrinsics = self.calibrator.leveled(extrinsics, self.imus.gravity)
        self._clocks = clocks
        return replace(extrinsics, clocks=clocks)

    def _conclude(self, extrinsics: Extrinsics, observed_s: float) -> Extrinsics:
        """Decide whether that was the last solution, which then has the body measures too."""
        parameters = self._parameters
        frames = self.calibrator.memory.frames()
        self.advice, self.progress = what_is_missing(extrinsics, frames, observed_s, parameters)
        has_all = set(extrinsics.sensors) == set(parameters.sensors)
        is_enough = not self.advice or observed_s >= parameters.collect_duration
        self.is_complete = has_all and is_enough
        if self.is_complete:
            samples = by_sensor(self._memory)
            self._memory.clear()
            measured = [one for name in extrinsics.sensors for one in samples.get(name, [])]
            return replace(extrinsics, body=measure_body(measured))
        later_s = max(parameters.collect_duration, observed_s + ATTEMPT_EVERY_S)
        next_s = min(NEXT_AFTER * observed_s, observed_s + NEXT_WITHIN_S)
        self._attempt_at_s = min(next_s, later_s)
        return extrinsics
