"""The node that replays sensors with faults, and records the graph's output."""

import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from pose_msgs.msg import Skeleton, SkeletonArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import JointState, TimeReference
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from pose_bench.faults.judging import Heard, Poses
from pose_bench.faults.packets import Frame, Imu, Note, Packet
from pose_core.stamps import NS_PER_S, nanoseconds
from pose_io.names import BODIES, TF_STATIC, WORLD_FRAME, imu_topic, sensor_frame, skeletons_topic
from pose_node.conversions import to_node_status
from pose_node.node_status import NodeStatus
from pose_node.nodes.qos import latched, reliable, sensor_data

BODY = f"{BODIES}subject"
SENSOR_QOS, RELIABLE_QOS = sensor_data(100), reliable(1000)
INT32 = np.iinfo(np.int32)

Planned = tuple[float, str, type, bytes]
"""Time after the start [s], topic, type, and serialised message."""


class FaultPlayer(Node):
    """Publishes serialised messages at their times; subscribes to the output and diagnostics."""

    def __init__(self) -> None:
        rclpy.init(args=[])
        super().__init__("fault_player")
        self._publishers_by_topic: dict[str, Any] = {}
        self._joints: list[tuple[int, bytes]] = []
        self._skeletons: list[tuple[int, bytes]] = []
        self._said: list[NodeStatus] = []
        self._executor = SingleThreadedExecutor()
        self.latest_s = 0.0  # [s] largest delay of a publication
        for kind, name, noted in (
            (JointState, "joint_states", self._joints),
            (Skeleton, "skeleton", self._skeletons),
        ):
            self.create_subscription(kind, f"{BODY}/{name}", _noting(noted), RELIABLE_QOS, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_said, RELIABLE_QOS)
        self._executor.add_node(self)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._closing.is_set():
            self._executor.spin_once(timeout_sec=0.2)

    def _on_said(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._said.append(to_node_status(status, time.time_ns()))

    def has_said(self, node: str) -> bool:
        """Whether a node has sent a report."""
        return any(said.name == node for said in self._said)

    def open(self, plan: Sequence[Planned]) -> None:
        """Create the publishers for a plan."""
        for _, topic, kind, _ in plan:
            if topic not in self._publishers_by_topic:
                profile = SENSOR_QOS
                if topic in (TF_STATIC, "/clock_offsets"):
                    profile = latched(10)
                elif topic == "/diagnostics":
                    profile = reliable(100)
                self._publishers_by_topic[topic] = self.create_publisher(kind, topic, profile)

    def play(
        self,
        plan: Sequence[Planned],
        acts: Sequence[tuple[float, Callable[[], None]]],
        start_ns: int,
        until_s: float,
    ) -> None:
        """Publish all messages and run all actions at their times."""
        publishers = self._publishers_by_topic
        begin = time.monotonic() + (start_ns - time.time_ns()) / NS_PER_S
        todo: list[tuple[float, Callable[[], None]]] = sorted(
            [*acts, *((at, partial(publishers[topic].publish, d)) for at, topic, _, d in plan)],
            key=lambda each: each[0],
        )
        for at_s, do in todo:
            if at_s > until_s:
                break
            wait_s = begin + at_s - time.monotonic()
            if wait_s > 0.0005:
                time.sleep(wait_s)
            else:
                self.latest_s = max(self.latest_s, -wait_s)
            do()
        time.sleep(max(0.0, begin + until_s - time.monotonic()))

    def heard(self) -> Heard:
        """All received messages."""
        joints = [(at, deserialize_message(data, JointState)) for at, data in list(self._joints)]
        bodies = [(at, deserialize_message(data, Skeleton)) for at, data in list(self._skeletons)]
        return Heard(
            joints=_poses(joints, [message.position for _, message in joints]),
            bodies=_poses(bodies, [[(p.x, p.y, p.z) for p in m.position] for _, m in bodies]),
            said=list(self._said),
        )

    def close(self) -> None:
        """Destroy the node."""
        self._closing.set()
        self._thread.join(timeout=2.0)
        self._executor.shutdown()
        self.destroy_node()
        rclpy.try_shutdown()


def _noting(noted: list[tuple[int, bytes]]) -> Callable[[bytes], None]:
    return lambda data: noted.append((time.time_ns(), data))


def _poses(messages: Sequence[tuple[int, Any]], values: Sequence[Any]) -> Poses:
    return Poses(
        stamps_ns=np.array([nanoseconds(m.header.stamp) for _, m in messages], np.int64),
        arrived_ns=np.array([at for at, _ in messages], np.int64),
        values=np.array(values, float),
    )


def planned(packet: Packet) -> Planned:
    """Serialise a packet."""
    topic, message = _message(packet)
    data = packet.raw if packet.raw is not None else serialize_message(message)
    if packet.flips:
        turned = bytearray(data)
        for place in packet.flips:
            turned[4 + place % (len(turned) - 4)] ^= 1 << place % 8
        data = bytes(turned)
    return packet.at_s, topic, type(message), data[: packet.cut]


def _message(packet: Packet) -> tuple[str, Any]:
    if isinstance(packet, Frame):
        return f"/{skeletons_topic(packet.source)}", _frame(packet)
    if isinstance(packet, Imu):
        return f"/{imu_topic(packet.source.removeprefix('imu/'))}", _imu(packet)
    assert isinstance(packet, Note)
    return NOTES[packet.source](packet)


def _time(stamp_ns: int) -> Time:
    second = min(max(stamp_ns // NS_PER_S, INT32.min), INT32.max)
    return Time(sec=int(second), nanosec=int(stamp_ns % NS_PER_S))


def _frame(frame: Frame) -> SkeletonArray:
    name = sensor_frame(frame.source) if frame.frame_id is None else frame.frame_id
    header = Header(stamp=_time(frame.stamp_ns), frame_id=name)
    return SkeletonArray(
        header=header,
        skeletons=[
            Skeleton(
                header=header,
                id=person.id,
                name=list(person.names),
                position=[Point(x=x, y=y, z=z) for x, y, z in person.positions.tolist()],
                tracking_state=person.states.tolist(),
            )
            for person in frame.persons
        ],
    )


def _imu(imu: Imu) -> ImuMessage:
    x, y, z, w = imu.orientation.tolist()
    variances = np.diag(imu.variances).reshape(-1)
    return ImuMessage(
        header=Header(stamp=_time(imu.stamp_ns), frame_id="imu"),
        orientation=Quaternion(x=x, y=y, z=z, w=w),
        orientation_covariance=variances,
        angular_velocity=_vector(imu.rate),
        linear_acceleration=_vector(imu.acceleration),
    )


def _vector(values: Any) -> Vector3:
    x, y, z = (float(value) for value in values)
    return Vector3(x=x, y=y, z=z)


def _static(note: Note) -> tuple[str, TFMessage]:
    message = TFMessage()
    if "raw" not in note.values:
        parent, child = note.values.get("frames", (WORLD_FRAME, sensor_frame("right")))
        transform = TransformStamped(
            header=Header(stamp=_time(note.stamp_ns), frame_id=parent), child_frame_id=child
        )
        transform.transform.translation = _vector([note.values["size"]] * 3)
        message.transforms.append(transform)
    return TF_STATIC, message


def _clock(note: Note) -> tuple[str, TimeReference]:
    offset_ns = round(note.values["offset_ns"])
    return "/clock_offsets", TimeReference(
        header=Header(stamp=_time(note.stamp_ns)),
        time_ref=_time(note.stamp_ns + offset_ns),
        source=note.values["source"],
    )


def _status(_note: Note) -> tuple[str, DiagnosticArray]:
    status = DiagnosticStatus(name="noise", message="x" * 100)
    return "/diagnostics", DiagnosticArray(status=[status])


NOTES: dict[str, Callable[[Note], tuple[str, Any]]] = {
    "tf_static": _static,
    "clock_offsets": _clock,
    "diagnostics": _status,
}
