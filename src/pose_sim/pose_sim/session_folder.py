"""A session as a folder of files: what the virtual devices replay, and the truth."""

import os
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pose_core.errors import InputError
from pose_core.plain_yaml import dump_yaml
from pose_io.recordings.formats import plain_csv
from pose_io.recordings.recording import Recording, make_recording, make_stream
from pose_sim import imu_file
from pose_sim.session import Session
from pose_sim.truth_bag import SUBJECT, write_truth
from pose_sim.virtual_imu import NODES

KINECTS_FILE = "kinects.csv"
IMU_FILE = "imu.npz"
IMU_NODES_FILE = "imu_nodes.yaml"
TRUTH_FOLDER = "truth"
SESSION_FILE = "session.yaml"


def write_session(path: Path, session: Session, start_ns: int) -> None:
    """Write a session folder; it appears only when it is complete.

    The same session and start always give the same bytes.

    Args:
        path: Folder to make.
        session: The session.
        start_ns: Stamp [ns] of its time zero, for the truth.

    Raises:
        InputError: If the folder exists or cannot be written.
    """
    if path.exists() or path.is_symlink():
        raise InputError(f"{path} exists already: name another folder, or remove it first")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden = Path(tempfile.mkdtemp(prefix=f".{path.name}.partial-", dir=path.parent))
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    try:
        _write_files(hidden, session, start_ns)
        hidden.chmod(0o755)
        if path.exists():
            raise InputError(f"{path} was made by someone else meanwhile: name another folder")
        os.rename(hidden, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def note_of(session: Session) -> str:
    """The sentence that goes with every file."""
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
    """What both Kinects delivered, as ``kinect_bridge`` keeps recordings."""
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
                f"kinect_{name}_optical_frame": {
                    "position": _plain(pose[:3, 3]),
                    "orientation": _plain(Rotation.from_matrix(pose[:3, :3]).as_quat()),
                }
                for name, pose in session.sensor_poses.items()
            },
            "heading_enu_map": round(session.heading_enu_map, 9),
            "imu_nodes": {
                node_id: {
                    "segment": alignment.segment,
                    "place": _plain(alignment.place),
                    "orientation_segment_sensor": _plain(alignment.R_segment_sensor.as_quat()),
                    "gyroscope_bias": _plain(alignment.gyroscope_bias),
                }
                for node_id, alignment in session.alignments.items()
            },
        },
    }


def _plain(values: np.ndarray) -> list[float]:
    return [round(value, 9) for value in values.tolist()]
