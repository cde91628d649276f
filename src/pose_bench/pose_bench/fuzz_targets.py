"""Fuzz targets: all readers of external data, with seed inputs."""

import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np

from imu_bridge.devices import PortConfig, read_devices
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import Chunk, ImuPipeline
from imu_bridge.protocols.reading import Parser
from imu_bridge.protocols.star import RawSample, StarParser, encode
from imu_bridge.protocols.text import TextParser, line_format
from imu_bridge.protocols.witmotion import WitMotionParser
from imu_bridge.segments import ImuNode
from kinect_bridge.sources.datagram import decode, to_person
from pose_bench.fuzzing import Target
from pose_calibration.board.camera import load_camera
from pose_calibration.files.extrinsics_file import load_extrinsics
from pose_calibration.imus.section import load_alignments
from pose_core.api import PipelineParameters, load_body_model, load_body_shape
from pose_core.errors import InputError
from pose_core.joints import JOINTS
from pose_core.parameters import from_ros_yaml
from pose_io.bag_repair import examine
from pose_io.bag_writer import BagWriter
from pose_io.bags import open_bag
from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.skeleton_bytes import SkeletonReader
from pose_io.message_maker import MessageMaker
from pose_io.names import sensor_frame
from pose_io.recordings.formats import read_recording
from pose_io.recordings.joint_map_files import find_joint_map
from pose_io.references.reading import read_reference
from pose_io.typestore import make_typestore
from pose_launch.document import read_launch_file

FIELDS = ["time", "node", "acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z"]
LINES = line_format({"fields": FIELDS, "units": {"time": "ms", "acc": "g", "gyro": "deg/s"}})
TEXT = b"0,1,0,0,1,0,0,0\n10,1,0.1,0,0.9,1,2,3\n20,1,1e3,0,1,0,-5.5,0\n"
STAR = b"".join(
    encode(
        RawSample(
            node_id=1,
            sequence=k,
            clock_us=10_000 * k,
            accelerometer=(0, 0, 16384),
            gyroscope=(k, -k, 5),
            magnetometer=(100, 0, -200),
            magnetometer_valid=k % 2 == 0,
        )
    )
    for k in range(4)
)


def _wit(kind: int, *numbers: int) -> bytes:
    packet = bytes([0x55, kind]) + struct.pack("<4h", *numbers)
    return packet + bytes([sum(packet) % 256])


WIT = b"".join(
    _wit(0x51, 0, 0, 2048, 0) + _wit(0x52, 5, -5, k, 0) + _wit(0x53, k, 0, 9, 0) for k in range(3)
)
SESSION = b"""version: 3
reference: left
map: {translation: [0.0, 0.0, 1.2], rotation: [-0.5, 0.5, -0.5, 0.5], source: body}
sensors:
  right: {translation: [1.5, 0.0, 0.6], rotation: [0.0, -0.4, 0.0, 0.9165], residuals: {frames: 9}}
clocks:
  right: {offset_ns: 21500000, drift_ppm: 0.0, at_ns: 1700000012345678900, stddev_ms: 2.1}
view_offsets:
  left: {head: [0.004, -0.002, 0.011]}
imus:
  version: 1
  segments:
    torso: {rotation: [0.0, 0.0, 0.0, 1.0], stddev_deg: [1.0, 1.0, 1.0], residual_deg: 1.0}
"""
SHAPE = b"version: 1\nbody_model: default\noffsets:\n" + b"".join(
    f"  {name}: [0.0, 0.1, 0.2]\n".encode() for name in JOINTS
)
PARAMETERS = b"/**:\n  ros__parameters:\n    estimator: default\n    sensors: [left, right]\n"
NODES = b"""nodes:
  1: torso
  2: {segment: head, gyroscope_bias: [0.0, 0.0, 0.1]}
ports:
  /dev/a:
    protocol: text
    segment: pelvis
    fields: [acc_x, acc_y, acc_z, gyro_x, gyro_y, gyro_z]
    units: {acc: g, gyro: deg/s}
"""
JOINT_MAP = b"""axes: {x: right, y: down, z: forward}
unit: m
map: {head: HEAD, neck: [A, 1]}
joints: [HEAD, A]
confidence: {inferred: 1, tracked: 2}
"""
CAMERA = b"""image_width: 640
image_height: 480
distortion_model: plumb_bob
camera_matrix: {data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}
distortion_coefficients: {data: [0, 0, 0, 0, 0]}
"""
CSV_COLUMNS = [f"{joint}_{value}" for joint in JOINTS for value in ("x", "y", "z", "state")]
CSV_HEAD = ",".join(["sensor", "host_time_s", "sensor_time_s", "person", *CSV_COLUMNS])
CSV_JOINTS = ",".join("0.1,0.2,2.5,2" for _ in JOINTS)
CSV_ROWS = (f"left,{100 + k / 30:.3f},{k / 30:.3f},1,{CSV_JOINTS}\n" for k in range(3))
CSV = f"{CSV_HEAD}\n{''.join(CSV_ROWS)}".encode()
LABELS = [name for name in JOINTS if name != "torso"]
COLUMNS = [
    "\t".join(f"{k + 0.1 * n + 0.01 * row:.2f}" for n in range(len(LABELS)) for k in range(3))
    for row in range(2)
]
TRC = (
    f"PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
    f"60\t60\t2\t{len(LABELS)}\tm\n"
    "Frame#\tTime\t" + "\t\t\t".join(LABELS) + "\n\t\t" + "\tX\tY\tZ" * len(LABELS)
    + f"\n\n1\t0.0\t{COLUMNS[0]}\n2\t0.0167\t{COLUMNS[1]}\n"
).encode()  # fmt: skip
MOT = (
    b"a\nversion=1\nnRows=2\nnColumns=2\ninDegrees=yes\nendheader\n"
    b"time\tknee_angle_r\n0.0\t1.0\n0.1\t2.0\n"
)
VICON = (
    "Trajectories\n100\n,," + ",,,".join(f"S:{name}" for name in LABELS) + "\nFrame,Sub Frame"
    + ",X,Y,Z" * len(LABELS) + "\n," + ",m,m,m" * len(LABELS)
    + "".join(f"\n{k + 1},0,{COLUMNS[k]}".replace("\t", ",") for k in range(2)) + "\n"
).encode()  # fmt: skip
NTU = (
    b"1\n1\n72057594037944738 0 1 1 0 0 0 0.1 0.2 2\n25\n" + b"0.1 0.2 2.5 0 0 0 0 0 0 0 1 2\n" * 25
)
DATAGRAM = b'{"v": 1, "seq": 5, "time_ns": 1, "people": [{"id": "a", "joints": [[0, 0, 2, 1]]}]}'
LAUNCH = b"""launch:
- arg: {name: a, default: 'b'}
- node:
    pkg: p
    exec: e
    param:
    - {name: rate, value: 2.5}
"""


def _parsed(make: Callable[[], Parser]) -> Callable[[bytes], object]:
    def read(data: bytes) -> object:
        parser = make()
        half = len(data) // 2
        return [*parser.parse(data[:half]), *parser.parse(data[half:]), *parser.finish()]

    return read


def _oriented(data: bytes) -> None:
    """Valid samples give an orientation, also after fuzzed ones."""
    node = ImuNode(segment="torso", node_id=1)
    pipeline = ImuPipeline([node], ImuBridgeParameters(), [TextParser(LINES)])
    pipeline.process([Chunk(arrival_ns=10**9, data=b"\n" + data + b"\n")])
    last = 0.0
    for k in range(3):
        line = f"{1e6 + 10 * k:.0f},1,0,0,1,0,0,0\n".encode()
        batch = pipeline.process([Chunk(arrival_ns=2 * 10**9 + 10**7 * k, data=line)])
        last = float(np.abs(batch.orientation).sum()) if len(batch) else last
    if not np.isfinite(last):
        raise AssertionError("good samples give no orientation any more")


@contextmanager
def _folder() -> Iterator[Path]:
    in_memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=in_memory if in_memory.is_dir() else None) as name:
        yield Path(name)


def _filed(folder: Path, name: str, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    """A reader of files."""
    path = folder / name

    def from_bytes(data: bytes) -> object:
        path.write_bytes(data)
        return read(path)

    return from_bytes


def _skeletons(data: bytes) -> None:
    for result in SkeletonReader("left").read([data, data[:-1], data]):
        if not isinstance(result, InputError):
            for person in result:
                np.isfinite(person.positions).any()


def _imus(data: bytes) -> None:
    block, _ = imu_block({"torso": [data, data[:-3], b""], "head": [data]})
    if not np.isfinite(block.orientation).all() or np.isinf(block.angular_velocity).any():
        raise AssertionError("an IMU's block holds what is no number")


def _datagram(data: bytes) -> None:
    joint_map = find_joint_map("azure_kinect")
    try:
        for person in decode(data).people:
            to_person(person, joint_map)
    except (msgspec.DecodeError, KeyError) as error:  # as the source counts them
        raise InputError(str(error)) from error


def _bag(path: Path) -> None:
    with open_bag(path) as bag:
        for message in bag.messages():
            bag.deserialize(message)


@contextmanager
def targets() -> Iterator[Sequence[Target]]:
    """All targets; their temporary folder is removed at the end."""
    model = load_body_model("default")
    with _folder() as folder:
        skeleton, imu, mcap = _messages(folder)

        def yaml(name: str, read: Callable[[Path], object], *seeds: bytes) -> Target:
            return Target(name=name, read=_filed(folder, f"{name}.yaml", read), seeds=seeds)

        sink = PortConfig(name="sink")
        yield (
            Target(name="text", read=_parsed(lambda: TextParser(LINES)), seeds=(b"\n" + TEXT,)),
            Target(name="star", read=_parsed(StarParser), seeds=(STAR,)),
            Target(name="witmotion", read=_parsed(WitMotionParser), seeds=(WIT,)),
            Target(name="orientation", read=_oriented, seeds=(TEXT,)),
            Target(name="skeleton messages", read=_skeletons, seeds=(skeleton,)),
            Target(name="IMU messages", read=_imus, seeds=(imu,)),
            yaml("session", load_extrinsics, SESSION),
            yaml("mountings", load_alignments, SESSION),
            yaml("shape", lambda path: load_body_shape(path, model), SHAPE),
            yaml("camera", load_camera, CAMERA),
            yaml("nodes", lambda path: read_devices(path, sink), NODES),
            yaml("joint map", lambda path: find_joint_map(str(path)), JOINT_MAP),
            yaml(
                "parameters",
                lambda path: from_ros_yaml(PipelineParameters, path, "fusion"),
                PARAMETERS,
            ),
            yaml("launch", read_launch_file, LAUNCH),
            Target(name="datagram", read=_datagram, seeds=(DATAGRAM,)),
            Target(name="CSV", read=_filed(folder, "a.csv", read_recording), seeds=(CSV, NTU)),
            Target(name="NTU", read=_filed(folder, "a.skeleton", read_recording), seeds=(NTU,)),
            Target(name="TRC", read=_filed(folder, "a.trc", read_reference), seeds=(TRC,)),
            Target(name="MOT", read=_filed(folder, "a.mot", read_reference), seeds=(MOT,)),
            Target(name="Vicon", read=_filed(folder, "v.csv", read_reference), seeds=(VICON,)),
            Target(name="bag", read=_filed(folder, "b.mcap", _bag), seeds=(mcap,)),
            Target(name="bag's condition", read=_filed(folder, "c.mcap", examine), seeds=(mcap,)),
        )


def _messages(folder: Path) -> tuple[bytes, bytes, bytes]:
    """A ``SkeletonArray``, an ``Imu`` message, and a bag with both."""
    store = make_typestore()
    make = MessageMaker(store)
    header = make.header(1_000_000_002, sensor_frame("left"))
    states = np.full(len(JOINTS), 2, np.uint8)
    person = make.skeleton(header, "1", np.tile([0.1, 0.2, 2.5], (len(JOINTS), 1)), states)
    frame = make.skeletons(header, [person, person])
    imu = make.imu(header, np.array([0.0, 0.0, 0.0, 1.0]), np.full(3, 0.1), np.zeros(3))
    with BagWriter(folder / "bag", typestore=store) as bag:
        for k in range(3):
            bag.write("/kinect_left/skeletons", frame, 10**9 + k)
            bag.write("/imu_torso/data", imu, 10**9 + k)
    (file,) = (folder / "bag").glob("*.mcap")
    serialised = bytes(store.serialize_cdr(frame, frame.__msgtype__))
    return serialised, bytes(store.serialize_cdr(imu, imu.__msgtype__)), file.read_bytes()
