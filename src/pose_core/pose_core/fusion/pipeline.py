"""The pipeline from samples to estimates, the same class live and offline.

Samples of the Kinects are transformed to ``map``. The first ones are used to measure the body; then
all are passed to the estimator, with the IMUs' orientations at the same instant. An estimator that
needs all sensors at common instants gets them aligned in time (li2020 (2)); any other gets the
frames of the sensors one by one. The output depends only on the samples, never on a clock. Between
two observations it is predicted live, and interpolated for a recording.
"""

from collections.abc import Callable, Iterable, Mapping

from pose_core.body.model import BodyModel
from pose_core.body.shape import BodyShape
from pose_core.counters import Counters
from pose_core.estimates.body_estimates import BodyEstimate, EstimateBlock
from pose_core.estimates.observation import Observation
from pose_core.estimators.parameters import PipelineParameters
from pose_core.estimators.registry import body_model_of
from pose_core.fusion.estimator_runner import EstimatorMaker, EstimatorRunner, runner_counters
from pose_core.fusion.output_grid import OutputGrid, has_output_rate
from pose_core.fusion.preprocessor import COUNTERS, Preprocessor
from pose_core.fusion.warm_up import warm_up
from pose_core.imu.imu_remarks import with_remarks
from pose_core.imu.imu_use import ImuUse
from pose_core.imu.sensor_to_segment import SensorsToSegments
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.clocks import ONE_IMU, Clock, Clocks, reference_delay_s
from pose_core.streams.samples import ImuBlock, ImuSample, SkeletonSample

MAX_BACKLOG_NS = 50_000_000  # [ns] older instants are not published
EARLIEST_S = -0.03  # [s] delay of a tracker; below it, the IMUs are late
UNKNOWN_DELAY_S = 0.02  # [s] standard deviation from which on a delay is not known
MAX_INTERPOLATED_NS = 100_000_000  # [ns] between two observations; a longer time is a gap
BLOCK = 50  # [estimates] of a recording that are published together


class Pipeline:
    """Estimates one person's pose from skeleton and IMU samples.

    Args:
        parameters: See :class:`PipelineParameters`.
        extrinsics: Poses of the sensors; may be set later (:meth:`use_extrinsics`).
        is_live: Whether the caller requests estimates with :meth:`publish_until`. Otherwise,
            for a recording, they are returned when samples are added.
        make_estimator: Factory of the estimator; the class named in the parameters if None.

    Attributes:
        imus: The IMUs with samples.
        aligner: Interpolates all sensors to common instants, if the estimator needs this.
    """

    def __init__(
        self,
        parameters: PipelineParameters,
        extrinsics: Extrinsics | None = None,
        *,
        is_live: bool = False,
        make_estimator: EstimatorMaker | None = None,
    ) -> None:
        self.parameters = parameters
        self.model: BodyModel = body_model_of(parameters)
        self.counters = Counters(*COUNTERS, *runner_counters(parameters), "outputs_skipped")
        self._runner = EstimatorRunner(self.model, parameters, self.counters, make_estimator)
        warm_up(parameters.estimator, self.model)
        self._preprocessor = Preprocessor(self.model, parameters, self.counters, is_live=is_live)
        self.imus, self.aligner = self._preprocessor.imus, self._preprocessor.aligner
        self.held_joints = self._preprocessor.held_joints
        self.tracked_joints = self._preprocessor.tracked_joints
        self._is_live = is_live
        self._grid: OutputGrid | None = None
        if has_output_rate(parameters):
            self._grid = OutputGrid(parameters.output_rate, parameters.forget_after)
        self.outlet: Callable[[EstimateBlock], None] | None = None
        """Receives each block of estimates, live before the next frame; none is returned."""
        if extrinsics is not None:
            self.use_extrinsics(extrinsics)

    @property
    def extrinsics(self) -> Extrinsics | None:
        """The sensors' poses, once they are known."""
        return self._preprocessor.extrinsics

    @property
    def shape(self) -> BodyShape | None:
        """The person's body measures, once they are known."""
        return self._preprocessor.shape

    @property
    def imu_uses(self) -> tuple[ImuUse, ...]:
        """State of use of each IMU with samples, by segment's name."""
        uses = {use.segment: use for use in self._runner.estimator.imu_uses}
        return tuple(
            with_remarks(
                uses.get(name) or self._unused(name),
                self.imus,
                self.clocks.get(ONE_IMU + name, Clock()),
                (self.first_ns, self.newest_ns),
            )
            for name in sorted(self.imus.segments)
        )

    @property
    def sensor_to_segment(self) -> SensorsToSegments:
        """Sensor-to-segment rotations of the aligned IMUs."""
        return self._runner.estimator.sensor_to_segment

    @property
    def tracker_delays_s(self) -> Mapping[str, tuple[float, float]]:
        """Delay of each sensor's tracker, measured with IMUs, and its standard deviation [s].

        A negative one means that the IMUs' samples are late.
        """
        measured = self._runner.estimator.measured_delays_s
        if measured is None:
            return {}
        delays = ((delay_s, stddev_s) for delay_s, stddev_s in measured.T.tolist())
        return dict(zip(self.parameters.sensors, delays, strict=True))

    @property
    def views_apart_m(self) -> Mapping[str, float]:
        """Distance of each sensor's view of the person from the estimate [m], if known."""
        apart = self._runner.estimator.views_apart_m
        return (
            {} if apart is None else dict(zip(self.parameters.sensors, apart.tolist(), strict=True))
        )

    @property
    def imus_late_s(self) -> float:
        """By how much the IMUs' samples come later than the frames [s]; 0 if they do not."""
        delays = self.tracker_delays_s.values()
        known_s = (delay_s for delay_s, stddev_s in delays if stddev_s < UNKNOWN_DELAY_S)
        earliest_s = min(known_s, default=0.0)
        return -earliest_s if earliest_s < EARLIEST_S else 0.0

    @property
    def first_ns(self) -> int:
        """Stamp of the first sample of any source [ns]."""
        return self._preprocessor.frames.first_ns

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest sample of any source [ns]."""
        return self._preprocessor.frames.newest_ns

    @property
    def silent_imus(self) -> tuple[str, ...]:
        """Segments whose IMU has stopped sending while another source still sends."""
        return self.imus.silent(self.newest_ns)

    def _unused(self, segment: str) -> ImuUse:
        """State of an IMU that the estimator has not received."""
        if not self.parameters.use_imus:
            return ImuUse(segment=segment, refused="use_imus is false: set it to true")
        if self.counters["estimates"] == 0:
            return ImuUse(segment=segment, refused="no pose yet: the cameras must see the person")
        if self._runner.estimator.USES_IMUS:
            if self.imus.has_samples(segment):
                reason = "no usable sample at any frame: see its stamps"
            else:
                reason = "no sample with an orientation: is it switched on, and does it send them?"
            return ImuUse(segment=segment, refused=reason)
        name = self.parameters.estimator
        return ImuUse(segment=segment, refused=f"the estimator {name} uses no IMUs: use default")

    @property
    def status(self) -> str:
        """State of the pipeline, as human-readable text."""
        return self._preprocessor.status

    @property
    def holds_frames(self) -> bool:
        """Whether a frame waits for an earlier frame of another sensor."""
        return self._preprocessor.frames.order.holds

    def use_extrinsics(self, extrinsics: Extrinsics) -> None:
        """Use these extrinsics, and their clocks, from now on.

        See :meth:`Preprocessor.use_extrinsics`. Past instants are not estimated.
        """
        self._find_delay(extrinsics.clocks)
        self._preprocessor.use_extrinsics(extrinsics)

    def use_sensor_to_segment(self, alignments: SensorsToSegments) -> None:
        """Use known alignments; headings and other IMUs are still aligned from motion."""
        self._runner.use_sensor_to_segment(alignments)

    @property
    def clocks(self) -> Clocks:
        """Clocks that correct the stamps."""
        return self._preprocessor.clocks

    def use_clocks(self, clocks: Clocks) -> None:
        """Correct later stamps by these clocks; earlier samples keep theirs."""
        self._find_delay(clocks)
        self._preprocessor.clocks = clocks

    def _find_delay(self, clocks: Clocks) -> None:
        """Take the trackers' delay from the clocks, if no parameter gives it."""
        known_s = self.parameters.tracker_delay
        self._runner.tracker_delay_s = known_s or reference_delay_s(clocks)

    def use_shape(self, shape: BodyShape) -> None:
        """Use these body measures from now on."""
        self._preprocessor.shape = shape

    def add(self, sample: SkeletonSample | ImuSample | ImuBlock) -> list[BodyEstimate]:
        """Add one person's joints from one sensor, or IMU samples.

        Returns:
            The estimates that are now complete, of a recording some together; none if there is
            an :attr:`outlet`.
        """
        return self._estimated(self._preprocessor.add(sample))

    def release_held(self) -> list[BodyEstimate]:
        """Process frames that wait for earlier ones: a live caller waits no longer."""
        return self._estimated(self._preprocessor.release_held())

    def flush(self) -> list[BodyEstimate]:
        """Process everything that is left, after the end of the streams."""
        estimates = self._estimated(self._preprocessor.flush())
        newest_ns = self.newest_ns
        if self._grid is not None and not self._is_live:
            self._publish_before(newest_ns + 1, longest_gap_ns=0)
        self._runner.flush(newest_ns)
        return estimates + self.publish_waiting()

    def publish_until(self, now_ns: int) -> list[BodyEstimate]:
        """Estimates at the output instants up to now, predicted from the samples received.

        Args:
            now_ns: Now [ns], on the reference sensor's clock.

        Returns:
            No estimate for an instant without a pose. Of a backlog only the newest instants;
            the others are counted as ``outputs_skipped``.
        """
        if self._grid is None:
            return []
        instants, skipped = self._grid.until(now_ns, MAX_BACKLOG_NS)
        self.counters.add("outputs_skipped", skipped)
        for instant_ns in instants:
            self._predict(instant_ns)
        return self.publish_waiting()

    def publish_waiting(self, least: int = 1) -> list[BodyEstimate]:
        """Publish the estimates of a recording that wait for a block of at least ``least``."""
        blocks = self._runner.take(least)
        if self.outlet is None:
            return [estimate for block in blocks for estimate in block]
        for block in blocks:
            self.outlet(block)
        return []

    def predict(self, stamp_ns: int) -> BodyEstimate | None:
        """The estimate at any instant; the instants of successive calls must increase.

        Args:
            stamp_ns: The instant [ns], on the reference sensor's clock.

        Returns:
            None if there is no pose at this instant.
        """
        imus, newest_ns = self._preprocessor.imus_at(stamp_ns), self.newest_ns
        return self._runner.predict_one(stamp_ns, newest_ns, imus)

    def _estimated(self, observations: Iterable[Observation]) -> list[BodyEstimate]:
        least = 1 if self._grid is None else BLOCK
        estimates: list[BodyEstimate] = []
        for observation in observations:
            if self._grid is not None and not self._is_live:
                self._publish_before(observation.stamp_ns)
            self._runner.process(observation)
            self._preprocessor.tracker_delays_ns = self._runner.tracker_delays_ns
            self.imus.z_down = self._runner.estimator.z_down_imus
            estimates += self.publish_waiting(least)
        return estimates

    def _publish_before(self, stamp_ns: int, longest_gap_ns: int = MAX_INTERPOLATED_NS) -> None:
        """Publish a recording's instants up to the last observation; in a gap, up to the next one.

        Between two observations they are interpolated, in a gap predicted.

        Args:
            stamp_ns: Instant of the next observation [ns].
            longest_gap_ns: Time between the observations up to which it is no gap [ns].
        """
        assert self._grid is not None
        last_ns, published_ns = self._runner.estimator.stamp_ns, self._grid.last_ns or 0
        is_in_gap = last_ns is not None and last_ns < published_ns <= stamp_ns
        if last_ns is not None and stamp_ns > last_ns and not is_in_gap:
            instants_ns = tuple(self._grid.before(last_ns + 1))
            self._runner.interpolate(instants_ns, self.newest_ns)
        if last_ns is None or stamp_ns > last_ns + longest_gap_ns:
            for instant_ns in self._grid.before(stamp_ns):
                self._predict(instant_ns)

    def _predict(self, stamp_ns: int) -> None:
        imus, newest_ns = self._preprocessor.imus_at(stamp_ns), self.newest_ns
        self._runner.predict(stamp_ns, newest_ns, imus)
