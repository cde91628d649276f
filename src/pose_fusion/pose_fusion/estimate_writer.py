"""Writes everybody's estimates of a recording into a bag."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pose_core.api import EstimateBlock, PeoplePipeline, make_urdf
from pose_core.stamps import NS_PER_S
from pose_evaluation.unseen import unseen_line
from pose_fusion.conversions import body_topics, to_bag_message, to_static_tf, type_name, urdf_topic
from pose_fusion.estimate_bytes import EstimateBytes
from pose_io.bag_writer import BagWriter
from pose_io.message_maker import MessageMaker
from pose_io.names import DIAGNOSTICS, FUSE_STATUS, TF_STATIC


class EstimateWriter:
    """Writes everybody's estimates into a bag, under the live topics' names."""

    def __init__(self, writer: BagWriter, pipeline: PeoplePipeline) -> None:
        self._writer = writer
        self._pipeline = pipeline
        maker = MessageMaker(writer.typestore)
        self._make, self._header = maker.make, maker.header
        self._bytes: dict[str, EstimateBytes] = {}
        self._begin_ns = 0  # [ns] stamp of the first sample
        self._last_ns = 0  # [ns] of the last estimate of anybody
        self._urdf: dict[str, object] = {}  # the measures that were written last, by id
        self._stamps_ns: list[NDArray[np.int64]] = []  # of the subject's estimates
        self._sources: list[NDArray[np.uint8]] = []  # of any of its degrees of freedom
        writer.add_topic(TF_STATIC, "tf2_msgs/msg/TFMessage", latched=True)
        writer.add_topic(DIAGNOSTICS, "diagnostic_msgs/msg/DiagnosticArray")

    def write(self, body_id: str, block: EstimateBlock) -> None:
        """Append all messages of one person's estimates, stamped with their instants."""
        model, stamp_ns = self._pipeline.subject.model, int(block.stamps_ns[0])
        self._last_ns = int(block.stamps_ns[-1])
        if body_id == self._pipeline.parameters.subject:
            self._begin_ns = self._begin_ns or self._pipeline.subject.first_ns
            self._stamps_ns.append(block.stamps_ns)
            self._sources.append(np.bitwise_or.reduce(block.source, axis=1))
        if not self._bytes:
            extrinsics = self._pipeline.extrinsics
            if extrinsics is not None:
                sensors = self._pipeline.parameters.sensors
                placed = {sensor: extrinsics.T_map_sensor(sensor) for sensor in sensors}
                transforms = to_bag_message(to_static_tf(placed), self._writer.typestore)
                self._writer.write(TF_STATIC, transforms, stamp_ns)
        if body_id not in self._bytes:
            self._writer.add_topic(urdf_topic(body_id), "std_msgs/msg/String", latched=True)
            for topic, message_type in body_topics(body_id).items():
                self._writer.add_topic(topic, type_name(message_type))
            typestore = self._writer.typestore
            self._bytes[body_id] = EstimateBytes(model, body_id, typestore, block[0])
        shape = self._pipeline.shape_of(body_id)
        if shape is not None and shape is not self._urdf.get(body_id):
            self._urdf[body_id] = shape
            urdf = self._make("std_msgs/String", data=make_urdf(model, shape, body_id))
            self._writer.write(urdf_topic(body_id), urdf, stamp_ns)
        latencies_s = (block.newest_ns - block.stamps_ns) / NS_PER_S
        to_bytes = self._bytes[body_id]
        topics = [
            (topic, to_bytes.types[topic], data.tobytes(), data.shape[1])
            for topic, data in to_bytes.write(block, latencies_s)
        ]
        for index, stamp_ns in enumerate(block.stamps_ns.tolist()):
            for topic, msgtype, data, size in topics:
                message = data[index * size : (index + 1) * size]
                self._writer.write_serialized(topic, msgtype, message, stamp_ns)

    def write_lines(self, lines: Iterable[str]) -> None:
        """Append what was said about the recording, as one status of ``/diagnostics``."""
        values = [
            self._make("diagnostic_msgs/KeyValue", key=str(number), value=line)
            for number, line in enumerate(lines, start=1)
        ]
        status = self._make(
            "diagnostic_msgs/DiagnosticStatus",
            level=0,
            name=FUSE_STATUS,
            message="what became of the recording's data",
            hardware_id="",
            values=values,
        )
        header = self._header(self._last_ns)
        array = self._make("diagnostic_msgs/DiagnosticArray", header=header, status=[status])
        self._writer.write(DIAGNOSTICS, array, self._last_ns)

    @property
    def unseen(self) -> str:
        """When no camera saw the subject, as a line; empty if one always did."""
        if not self._stamps_ns:
            return ""
        stamps_ns, sources = np.concatenate(self._stamps_ns), np.concatenate(self._sources)
        return unseen_line(stamps_ns, sources, self._begin_ns, self._pipeline.subject.newest_ns)
