"""The pipeline from samples to estimates, the same class live and offline.

Samples of several Kinects are brought into ``map``, used first to measure the body and then handed
to the estimator, with the IMUs' orientations of the same instant. An estimator that wants all
sensors at common instants gets them aligned in time (li2020 (2)); any other gets each sensor's
frame as it comes. What comes out depends on the samples alone, never on a clock.
"""

from collections.abc import Callable, Iterable, Iterator

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimators.registry import body_model_of, estimator_class
from pose_core.filter.imu_use import ImuUse
from pose_core.fusion.estimates import BodyEstimate, EstimateBlock
from pose_core.fusion.estimator_runner import EstimatorMaker, EstimatorRunner, runner_counters
from pose_core.fusion.observation import Observation
from pose_core.fusion.parameters import FusionParameters
from pose_core.fusion.pose_block import PoseBlock
from pose_core.fusion.preprocessor import COUNTERS, Preprocessor
from pose_core.fusion.warm_up import warm_up
from pose_core.imu.imu_set import ImuSet
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.session.clocks import Clocks
from pose_core.session.extrinsics import Extrinsics
from pose_core.stamps import NS_PER_S
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample
from pose_core.streams.time_alignment import TimeAligner

JUMP_BACK_NS = NS_PER_S  # [ns] further back than this, a recording has begun anew


LONGEST_BACKLOG_NS = 50_000_000  # [ns] what is older is not published


class OutputGrid:
    """Instants of one period, each given once, in strictly increasing order.

    Args:
        rate: [Hz].
        longest_gap_s: [s] after the last known state nothing is published.
    """

    def __init__(self, rate: float, longest_gap_s: float) -> None:
        self.period_ns = round(NS_PER_S / rate)
        self._longest_gap_ns = round(longest_gap_s * NS_PER_S)
        self._last_ns: int | None = None

    def before(self, stamp_ns: int) -> Iterator[int]:
        """Those before an instant [ns], of a recording; of a long gap, the first ones."""
        last_ns = self._last_ns
        if last_ns is None or stamp_ns < last_ns - JUMP_BACK_NS:
            self._last_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
            return
        end_ns = (stamp_ns - 1) // self.period_ns * self.period_ns
        first_ns = last_ns + self.period_ns
        for instant_ns in range(
            first_ns, min(end_ns, last_ns + self._longest_gap_ns) + 1, self.period_ns
        ):
            self._last_ns = instant_ns
            yield instant_ns
        self._last_ns = max(self._last_ns or end_ns, end_ns)

    def until(self, now_ns: int, longest_backlog_ns: int) -> tuple[range, int]:
        """Those up to now [ns], live, of a backlog the newest ones; and how many are left out.

        The grid lies a quarter of a period before the first call's now, so that calls of the same
        period find one instant each.
        """
        if self._last_ns is None or now_ns < self._last_ns - JUMP_BACK_NS:
            self._last_ns = now_ns - self.period_ns // 4 - self.period_ns
        count = (now_ns - self._last_ns) // self.period_ns
        if count <= 0:
            return range(0), 0
        skipped = max(0, count - max(1, longest_backlog_ns // self.period_ns))
        first_ns = self._last_ns + (skipped + 1) * self.period_ns
        self._last_ns += count * self.period_ns
        return range(first_ns, self._last_ns + 1, self.period_ns), skipped


def has_output_rate(parameters: FusionParameters) -> bool:
    """Whether estimates come at ``output_rate``; otherwise once for each frame."""
    can_predict = estimator_class(parameters.estimator).CAN_PREDICT
    return can_predict and parameters.output_rate > 0.0


class FusionPipeline:
    """Turns skeleton and IMU samples into estimates of one person's pose.

    Args:
        parameters: See :class:`FusionParameters`.
        extrinsics: Where the sensors are; may come later (:meth:`place_sensors`).
        shape: The person's measures; measured from the first samples if None.
        is_live: Whether estimates are asked for by :meth:`publish_until`; otherwise, of a
            recording, they come with the samples.
        make_estimator: Makes the estimator; the class that the parameters name if None.
    """

    def __init__(
        self,
        parameters: FusionParameters,
        extrinsics: Extrinsics | None = None,
        shape: BodyShape | None = None,
        *,
        is_live: bool = False,
        make_estimator: EstimatorMaker | None = None,
    ) -> None:
        self.parameters = parameters
        self.model: BodyModel = body_model_of(parameters)
        self.counters = Counters(*COUNTERS, *runner_counters(parameters), "outputs_skipped")
        self._runner = EstimatorRunner(self.model, parameters, self.counters, make_estimator)
        warm_up(parameters.estimator, self.model)
        self._preprocessor = Preprocessor(self.model, parameters, self.counters)
        self._is_live = is_live
        self._grid: OutputGrid | None = None
        if has_output_rate(parameters):
            self._grid = OutputGrid(parameters.output_rate, parameters.forget_after)
        self.outlet: Callable[[EstimateBlock], None] | None = None
        """Receives each block of estimates before the next frame is processed; none is returned."""
        if extrinsics is not None:
            self.place_sensors(extrinsics)
        if shape is not None:
            self.use_shape(shape)

    @property
    def extrinsics(self) -> Extrinsics | None:
        """The sensors' poses, once they are known."""
        return self._preprocessor.extrinsics

    @property
    def clocks(self) -> Clocks:
        """The clocks by which stamps are corrected."""
        return self._preprocessor.clocks

    @property
    def shape(self) -> BodyShape | None:
        """The person's measures, once they are known."""
        return self._preprocessor.shape

    @property
    def imus(self) -> ImuSet:
        """The IMUs with samples."""
        return self._preprocessor.imus

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples, by segment's name."""
        uses = {use.segment: use for use in self._runner.imu_uses}
        for name in self.imus.segments:
            use = uses.setdefault(name, self._unused(name))
            fault = self.imus.rate_faults.get(name)
            instead = "; the orientation's change is used"
            use.remark = f"its angular velocity {fault}{instead}" if fault else ""
        return tuple(uses[name] for name in sorted(self.imus.segments))

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """How the IMUs sit that are aligned now."""
        return self._runner.sensor_to_segment

    @property
    def silent_imus(self) -> tuple[str, ...]:
        """Segments whose IMU sends nothing any more, while another source does."""
        return self.imus.silent(self._preprocessor.newest_ns)

    def _unused(self, segment: str) -> ImuUse:
        """State of an IMU that the estimator has not received."""
        if not self.parameters.use_imus:
            return ImuUse(segment=segment, refused="use_imus is false: set it to true")
        if self.counters["estimates"] == 0:
            return ImuUse(segment=segment, refused="no pose yet: the cameras must see the person")
        if self._runner.uses_imus:
            return ImuUse(segment=segment, refused="no usable sample at any frame: see its stamps")
        name = self.parameters.estimator
        return ImuUse(segment=segment, refused=f"the estimator {name} uses no IMUs: use default")

    @property
    def aligner(self) -> TimeAligner:
        """Brings all sensors to common instants, if the estimator wants that."""
        return self._preprocessor.aligner

    @property
    def status(self) -> str:
        """State of the pipeline, as text for people."""
        return self._preprocessor.status

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for another sensor's that should come before it."""
        return self._preprocessor.holds_frames

    def place_sensors(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on; see :meth:`Observer.place_sensors`.

        Estimates of the past are not made.
        """
        self._preprocessor.place_sensors(extrinsics)

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use sensor-to-segment rotations of a calibration; none are estimated from motion."""
        self._runner.use_sensor_to_segment(alignments)

    def use_clocks(self, clocks: Clocks) -> None:
        """Correct later stamps by these clocks; earlier samples keep theirs."""
        self._preprocessor.clocks = clocks

    def use_shape(self, shape: BodyShape) -> None:
        """Track a body of these measures from now on."""
        self._preprocessor.shape = shape

    def add(self, sample: SkeletonSample | ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Add one person's joints from one sensor, or IMU samples.

        Returns:
            The estimates that this completes; none if there is an :attr:`outlet`.
        """
        return self._estimated(self._preprocessor.add(sample))

    def wait_no_longer(self) -> list[BodyEstimate]:
        """Go on without the frames that others wait for: a live caller's patience has ended."""
        return self._estimated(self._preprocessor.wait_no_longer())

    def flush(self) -> list[BodyEstimate]:
        """Wait for nothing more: the streams have ended."""
        estimates = self._estimated(self._preprocessor.flush())
        newest_ns = self._preprocessor.newest_ns
        if self._grid is not None and not self._is_live:
            estimates += self._output_before(newest_ns + 1)
        return estimates + self._published(self._runner.flush(newest_ns))

    def publish_until(self, now_ns: int) -> list[BodyEstimate]:
        """The estimates of the output's instants up to now, predicted from what has come.

        Args:
            now_ns: Now [ns], on the reference sensor's clock.

        Returns:
            None of an instant at which there is no pose, or none any more; of a backlog the
            newest, the others are counted as ``outputs_skipped``.
        """
        if self._grid is None:
            return []
        self.calibrate_session()
        instants, skipped = self._grid.until(now_ns, LONGEST_BACKLOG_NS)
        self.counters.add("outputs_skipped", skipped)
        return [estimate for instant_ns in instants for estimate in self._output_at(instant_ns)]

    def predict(self, stamp_ns: int) -> BodyEstimate | None:
        """The estimate of an instant of one's own choice; instants are to increase.

        Args:
            stamp_ns: The instant [ns], on the reference sensor's clock.

        Returns:
            None while there is no pose, or none any more.
        """
        self.calibrate_session()
        readings, newest_ns = self._preprocessor.readings(stamp_ns), self._preprocessor.newest_ns
        blocks = self._runner.predict(stamp_ns, newest_ns, readings)
        return blocks[0][0] if blocks else None

    def calibrate_session(self) -> None:
        """Calibrate the session with the last frame, whose estimate has been published before.

        Otherwise done when the next sample comes: a live caller has it done while it waits. The
        estimates are the same.
        """
        self._preprocessor.calibrate_session()

    def _estimated(self, observations: Iterable[Observation]) -> list[BodyEstimate]:
        estimates: list[BodyEstimate] = []
        for observation in observations:
            if self._grid is None:
                poses = self._update(observation)
                estimates += self._published(self._runner.estimates(poses))
                continue
            if not self._is_live:
                estimates += self._output_before(observation.stamp_ns)
            self._update(observation)
        return estimates

    def _update(self, observation: Observation) -> PoseBlock | None:
        poses = self._runner.update(observation)
        self._preprocessor.tracker_delays_ns = self._runner.tracker_delays_ns
        return poses

    def _output_before(self, stamp_ns: int) -> list[BodyEstimate]:
        assert self._grid is not None
        instants = self._grid.before(stamp_ns)
        return [estimate for instant_ns in instants for estimate in self._output_at(instant_ns)]

    def _output_at(self, stamp_ns: int) -> list[BodyEstimate]:
        readings, newest_ns = self._preprocessor.readings(stamp_ns), self._preprocessor.newest_ns
        return self._published(self._runner.predict(stamp_ns, newest_ns, readings))

    def _published(self, blocks: Iterable[EstimateBlock]) -> list[BodyEstimate]:
        if self.outlet is None:
            return [estimate for block in blocks for estimate in block]
        for block in blocks:
            self.outlet(block)
        return []
