"""Fuzz targets: all readers of external data, with seed inputs, most of them in ``seeds/``."""

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
from imu_bridge.protocols.star import StarParser
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
SEEDS = {path.stem: path.read_bytes() for path in (Path(__file__).parent / "seeds").iterdir()}
"""Valid inputs by the names of their files."""


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


def _filed(path: Path, read: Callable[[Path], object]) -> Callable[[bytes], object]:
    """A reader of files, given a file's content."""

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


def _read_parameters(path: Path) -> object:
    return from_ros_yaml(PipelineParameters, path, "fusion")


def _bag(path: Path) -> None:
    with open_bag(path) as bag:
        for message in bag.messages():
            bag.deserialize(message)


@contextmanager
def targets() -> Iterator[Sequence[Target]]:
    """All targets; their temporary folder is removed at the end."""
    model, sink = load_body_model("default"), PortConfig(name="sink")
    files: dict[str, tuple[str, Callable[[Path], object], Sequence[bytes]]] = {
        "session": ("a.yaml", load_extrinsics, [SEEDS["session"]]),
        "alignments": ("a.yaml", load_alignments, [SEEDS["session"]]),
        "shape": ("a.yaml", lambda path: load_body_shape(path, model), [SEEDS["shape"]]),
        "camera": ("a.yaml", load_camera, [SEEDS["camera"]]),
        "nodes": ("a.yaml", lambda path: read_devices(path, sink), [SEEDS["nodes"]]),
        "joint map": ("a.yaml", lambda path: find_joint_map(str(path)), [SEEDS["joint_map"]]),
        "parameters": ("a.yaml", _read_parameters, [SEEDS["parameters"]]),
        "launch": ("a.yaml", read_launch_file, [SEEDS["launch"]]),
        "CSV": ("a.csv", read_recording, [SEEDS["csv"], SEEDS["ntu"]]),
        "NTU": ("a.skeleton", read_recording, [SEEDS["ntu"]]),
        "TRC": ("a.trc", read_reference, [SEEDS["trc"]]),
        "MOT": ("a.mot", read_reference, [SEEDS["mot"]]),
        "Vicon": ("a.csv", read_reference, [SEEDS["vicon"]]),
    }
    with _folder() as folder:
        skeleton, imu, mcap = _messages(folder)
        files |= {"bag": ("a.mcap", _bag, [mcap]), "bag's condition": ("a.mcap", examine, [mcap])}
        streams: dict[str, tuple[Callable[[bytes], object], bytes]] = {
            "text": (_parsed(lambda: TextParser(LINES)), b"\n" + SEEDS["text"]),
            "star": (_parsed(StarParser), SEEDS["star"]),
            "witmotion": (_parsed(WitMotionParser), SEEDS["witmotion"]),
            "orientation": (_oriented, SEEDS["text"]),
            "skeleton messages": (_skeletons, skeleton),
            "IMU messages": (_imus, imu),
            "datagram": (_datagram, SEEDS["datagram"]),
        }
        yield (
            *(Target(name=name, read=read, seeds=[seed]) for name, (read, seed) in streams.items()),
            *(
                Target(name=name, read=_filed(folder / file, read), seeds=seeds)
                for name, (file, read, seeds) in files.items()
            ),
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
