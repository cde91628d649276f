"""What the nodes of fusion and calibration do with messages, without a middleware.

Messages come in as bytes and outputs are serialised, as in the nodes; they are not sent. The clock
is an argument.
"""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from pose_bench.faults.judging import Poses
from pose_calibration.imus.section import alignments_document
from pose_calibration.live.live_calibration import LiveCalibration
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.api import (
    BodyShape,
    EstimateBlock,
    Extrinsics,
    PeoplePipeline,
    PipelineParameters,
    StampCheck,
    make_urdf,
    warm_up,
)
from pose_core.counters import Counters
from pose_core.errors import InputError
from pose_fusion.estimate_bytes import EstimateBytes
from pose_fusion.nodes.calibration import EVERY_OTHER
from pose_fusion.nodes.calibration_report import calibration_report
from pose_fusion.nodes.fusion_report import FusionReporter
from pose_fusion.sample_reader import COUNTS, MessageTimes, SampleReader
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import SkeletonReader
from pose_io.typestore import make_typestore
from pose_sim.scene import SENSORS

LOOK_STEPS, REPORT_STEPS = 20, 100  # [steps of 10 ms] between looks at the sources, and reports


class LiveSession:
    """A fusion of two people and a calibration.

    Args:
        extrinsics: Poses of the cameras, known to the fusion; the calibration looks for them.
        output_rate: Estimates per second [Hz].

    Attributes:
        outputs: Number of estimates that were serialised.
        bytes: Number of their bytes.
    """

    def __init__(self, extrinsics: Extrinsics, output_rate: float) -> None:
        parameters = PipelineParameters(sensors=SENSORS, max_people=2, output_rate=output_rate)
        self.fusion = PeoplePipeline(parameters, self._publish, extrinsics, is_live=True)
        self.calibration = LiveCalibration(LiveCalibrationParameters(sensors=SENSORS))
        self.outputs = self.bytes = 0
        self.kept: list[EstimateBlock] | None = None  # of the subject, while not None
        model = self.fusion.subject.model
        self._example = warm_up(parameters.estimator, model)
        self._typestore = make_typestore()
        self._bodies: dict[str, EstimateBytes] = {}
        self._counters = Counters(*COUNTS)
        self._reader = SampleReader(SENSORS, StampCheck(), self._counters)
        self._reporter = FusionReporter(self.fusion, self._reader)
        self._calibration_readers = {sensor: SkeletonReader(sensor) for sensor in SENSORS}
        self._calibration_imus: dict[str, list[bytes]] = defaultdict(list)
        self._steps = 0
        self._shape: BodyShape | None = None  # of the URDF

    def step(self, messages: Sequence[tuple[str, bytes]], now_ns: int) -> None:
        """One period of the fusion's timer.

        Args:
            messages: The source of each message (``left``, ``imu/<segment>``) and its bytes.
            now_ns: The clock [ns].
        """
        imus: dict[str, list[bytes]] = defaultdict(list)
        for source, data in messages:
            if source.startswith("imu/"):
                imus[source.removeprefix("imu/")].append(data)
        self._take_imus(imus, now_ns)
        for source, data in messages:
            if source in SENSORS:
                self._take_frame(source, data, now_ns)
        self.fusion.publish_until(now_ns)
        self._steps += 1
        if self._steps % LOOK_STEPS == 0:
            self._reporter.check()
        if self._steps % REPORT_STEPS == 0:
            self._report()

    def _take_imus(self, datas: dict[str, list[bytes]], now_ns: int) -> None:
        for segment, of_one in datas.items():
            self._calibration_imus[segment].extend(of_one)
        if datas:
            self.fusion.add(self._reader.imus(datas, now_ns, self.fusion.clocks))

    def _take_frame(self, sensor: str, data: bytes, now_ns: int) -> None:
        times = MessageTimes(published_ns=now_ns, received_ns=now_ns, taken_ns=now_ns)
        frame = self._reader.frame(sensor, data, times, self.fusion.clocks)
        if frame is not None:
            self.fusion.add(frame)
            self.fusion.release_held()
        self._calibrate(sensor, data)

    def _calibrate(self, sensor: str, data: bytes) -> None:
        taken = {s: datas[::EVERY_OTHER] for s, datas in self._calibration_imus.items()}
        self._calibration_imus.clear()
        if taken:
            self.calibration.imu_memory.add(imu_block(taken)[0])
        (persons,) = self._calibration_readers[sensor].read([data])
        if not isinstance(persons, InputError):
            self.calibration.add(persons)
            self.calibration.take_clocks()

    def _publish(self, body_id: str, estimates: EstimateBlock) -> None:
        if body_id not in self._bodies:
            model = self.fusion.subject.model
            self._bodies[body_id] = EstimateBytes(model, body_id, self._typestore, self._example[0])
        for _, rows in self._bodies[body_id].write(estimates, np.zeros(len(estimates))):
            self.bytes += rows.nbytes
        self.outputs += len(estimates)
        if self.kept is not None and body_id == self.fusion.parameters.subject:
            self.kept.append(estimates)
        self._reader.stages.note_output(int(estimates.stamps_ns[-1]))

    def _report(self) -> None:
        """What the nodes do each second."""
        self._reporter.report((), {}, {})
        calibration_report(self.calibration, self._counters, "")
        alignments_document(self.fusion.subject.sensor_to_segment)
        for body_id in self._bodies.keys() - self.fusion.remembered:
            del self._bodies[body_id]
        shape = self.fusion.shape_of(self.fusion.parameters.subject)
        if shape is not None and shape is not self._shape:
            self._shape = shape
            make_urdf(self.fusion.subject.model, shape, "subject")

    def take_kept(self) -> Poses:
        """The subject's joints since ``kept`` was set to an empty list."""
        blocks, self.kept = self.kept or [], None
        stamps_ns = np.concatenate([np.zeros(0, np.int64), *(b.stamps_ns for b in blocks)])
        joints = np.concatenate([np.zeros((0, 15, 3)), *(block.joints for block in blocks)])
        return Poses(stamps_ns=stamps_ns, arrived_ns=stamps_ns, values=joints)
