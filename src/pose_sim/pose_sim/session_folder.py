"""A session as a folder of files: the data of the virtual devices, and the ground truth."""

import os
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.errors import InputError, writing
from pose_core.joints import JOINTS, TrackingState
from pose_core.plain_yaml import dump_yaml
from pose_core.stamps import NS_PER_S
from pose_io.bag_writer import BagWriter
from pose_io.message_maker import MessageMaker
from pose_io.names import ABOUT_TOPIC, BODIES, TRUTH_NAMESPACE, WORLD_FRAME, sensor_frame
from pose_io.recordings.formats import plain_csv
from pose_io.recordings.recording import Recording, make_recording, make_stream
from pose_io.typestore import make_typestore
from pose_sim import imu_file
from pose_sim.angles import true_joint_angles
from pose_sim.motion import GRID_RATE
from pose_sim.session import Session
from pose_sim.virtual_imu import NODES

TRUTH_RATE = 100.0  # [Hz]
SUBJECT = "subject"
BODY_TOPIC = f"{TRUTH_NAMESPACE}{BODIES}{SUBJECT}"
SKELETON_TOPIC = f"{BODY_TOPIC}/skeleton"
JOINT_STATES_TOPIC = f"{BODY_TOPIC}/joint_states"
TF_TOPIC = f"{TRUTH_NAMESPACE}/tf_static"


KINECTS_FILE = "kinects.csv"
IMU_FILE = "imu.npz"
IMU_NODES_FILE = "imu_nodes.yaml"
TRUTH_FOLDER = "truth"
SESSION_FILE = "session.yaml"


def write_truth(path: Path, session: Session, start_ns: int, note: str) -> None:
    """Write the true joints and joint angles at 100 Hz, and the sensors' poses.

    Args:
        path: Folder to create.
        session: The session.
        start_ns: Stamp [ns] of the session's time zero.
        note: Origin of the data.

    Raises:
        InputError: If the folder exists or cannot be written.
    """
    typestore = make_typestore()
    step = round(GRID_RATE / TRUTH_RATE)
    times = session.motion.times
    by_name = true_joint_angles(session.motion)
    angles = np.stack(list(by_name.values()), axis=1)
    rates = np.gradient(angles, times, axis=0)
    joints = session.motion.pose.joints
    make = MessageMaker(typestore)
    tracked = np.full(len(JOINTS), TrackingState.TRACKED, np.uint8)
    with BagWriter(path, typestore=typestore) as bag:
        bag.add_topic(ABOUT_TOPIC, "std_msgs/msg/String", latched=True)
        bag.add_topic(TF_TOPIC, "tf2_msgs/msg/TFMessage", latched=True)
        bag.write(ABOUT_TOPIC, make.make("std_msgs/String", data=note), start_ns)
        bag.write(TF_TOPIC, make.sensor_transforms(session.sensor_poses, start_ns), start_ns)
        for index in range(0, len(times), step):
            stamp_ns = start_ns + round(float(times[index]) * NS_PER_S)
            skeleton = make.skeleton(
                make.header(stamp_ns, WORLD_FRAME), SUBJECT, joints[index], tracked
            )
            bag.write(SKELETON_TOPIC, skeleton, stamp_ns)
            states = make.make(
                "sensor_msgs/JointState",
                header=make.header(stamp_ns),
                name=list(by_name),
                position=angles[index],
                velocity=rates[index],
                effort=np.empty(0),
            )
            bag.write(JOINT_STATES_TOPIC, states, stamp_ns)


def write_session(path: Path, session: Session, start_ns: int) -> None:
    """Write a session folder atomically.

    The same session and start always give the same bytes.

    Args:
        path: Folder to create.
        session: The session.
        start_ns: Stamp [ns] of its time zero, for the truth.

    Raises:
        InputError: If the folder exists or cannot be written.
    """
    if path.exists() or path.is_symlink():
        raise InputError(f"{path} exists already: name another folder, or remove it first")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden = Path(tempfile.mkdtemp(prefix=f".{path.name}.partial-", dir=path.parent))
        try:
            _write_files(hidden, session, start_ns)
            hidden.chmod(0o755)
            if path.exists():
                raise InputError(f"{path} was created by another program: name another folder")
            os.rename(hidden, path)
        finally:
            shutil.rmtree(hidden, ignore_errors=True)


def note_of(session: Session) -> str:
    """Description of the data, written to every file."""
    if session.is_captured:
        return (
            f"captured motion of {session.choreography}, simulated sensors, made by pose_sim "
            f"(seed {session.seed})"
        )
    return (
        f"synthetic: no person, made by pose_sim (choreography {session.choreography}, "
        f"seed {session.seed})"
    )


def as_recording(session: Session) -> Recording:
    """Frames of both Kinects as a recording of ``kinect_bridge``."""
    return make_recording(
        KINECTS_FILE,
        "csv",
        [
            make_stream(
                name,
                host_time_ns=frames.host_time_ns,
                sensor_time_ns=frames.sensor_time_ns,
                person=[SUBJECT] * len(frames.host_time_ns),
                positions=frames.positions,
                tracking_state=frames.tracking_state,
            )
            for name, frames in session.kinects.items()
        ],
        time_zero_ns=0,
        comments=[note_of(session)],
    )


def _write_files(folder: Path, session: Session, start_ns: int) -> None:
    note = note_of(session)
    plain_csv.write(folder / KINECTS_FILE, as_recording(session))
    imu_file.write(folder / IMU_FILE, session.imus, note)
    nodes = dump_yaml({"nodes": dict(NODES)})
    (folder / IMU_NODES_FILE).write_text(f"# {note}\n{nodes}")
    write_truth(folder / TRUTH_FOLDER, session, start_ns, note)
    description = dump_yaml(_description(session, start_ns))
    (folder / SESSION_FILE).write_text(f"# {note}\n{description}")


def _description(session: Session, start_ns: int) -> dict[str, Any]:
    parameters = asdict(session.settings)
    return {
        "synthetic": True,
        "note": note_of(session),
        "choreography": session.choreography,
        "duration": session.duration,
        "seed": session.seed,
        "start_at": start_ns,
        "noise": parameters.pop("noise"),
        "parameters": parameters,
        "truth": {
            "sensor_poses": {
                sensor_frame(name): {
                    "position": _plain(pose[:3, 3]),
                    "orientation": _plain(Rotation.from_matrix(pose[:3, :3]).as_quat()),
                }
                for name, pose in session.sensor_poses.items()
            },
            "heading_enu_map": round(session.heading_enu_map, 9),
            "imu_nodes": {
                node_id: {
                    "segment": node.segment,
                    "place": _plain(node.place),
                    "orientation_segment_sensor": _plain(node.R_segment_sensor.as_quat()),
                    "gyroscope_bias": _plain(node.gyroscope_bias),
                }
                for node_id, node in session.nodes.items()
            },
        },
    }


def _plain(values: np.ndarray) -> list[float]:
    return [round(value, 9) for value in values.tolist()]
