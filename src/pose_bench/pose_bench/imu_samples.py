"""A session's IMU nodes as ``imu_bridge`` would publish them, kept on disk for the next time."""

import hashlib
import json
import os
import tempfile
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache as remembered
from pathlib import Path
from types import ModuleType

import numpy as np

import imu_bridge
import pose_sim
from imu_bridge.parameters import ImuBridgeParameters
from imu_bridge.pipeline import Chunk, ImuPipeline
from imu_bridge.segments import ImuNode
from pose_core.api import FloatArray, ImuSample
from pose_sim.imu_file import encode_all
from pose_sim.session import Session
from pose_sim.virtual_imu import NODES

MAGNETOMETER = "start"  # as the launch file has it, beside cameras
FILTER = "vqf"
TimedImuSample = tuple[int, ImuSample]
"""Arrival at the host [ns], and the sample."""


def imu_samples(
    session: Session, start_ns: int, folder: Path | None, imu_filter: str = FILTER
) -> list[TimedImuSample]:
    """The samples of all nodes of a session, in order of arrival.

    Args:
        session: The session.
        start_ns: Stamp [ns] of its time zero.
        folder: Where columns are kept; None makes them anew.
        imu_filter: The bridge's orientation filter.
    """
    parameters = ImuBridgeParameters(filter=imu_filter, magnetometer=MAGNETOMETER)
    if folder is None:
        return _samples(_columns(session, parameters), start_ns)
    path = folder / f"imu_{_key(session, parameters)}.npz"
    try:
        with np.load(path, allow_pickle=False) as archive:
            columns = dict(archive)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error):
        columns = _columns(session, parameters)
        _keep(path, columns)
    return _samples(columns, start_ns)


def _columns(session: Session, parameters: ImuBridgeParameters) -> dict[str, np.ndarray]:
    """What the bridge makes of the session's bytes; times [ns] are the session's own."""
    nodes = [ImuNode(node_id=node_id, segment=segment) for node_id, segment in NODES.items()]
    pipeline = ImuPipeline.from_parameters(nodes, parameters)
    due_ns = session.imus.due_ns
    chunks = [
        Chunk(arrival_ns=arrival_ns, data=data)
        for arrival_ns, data in zip(due_ns.tolist(), encode_all(session.imus), strict=True)
    ]
    batch = pipeline.process(chunks)  # one frame a chunk, each of them a sample
    inclination = np.full(len(batch), parameters.inclination_stddev)
    known = ~np.isnan(batch.orientation[:, 3])
    return {
        "arrival_ns": due_ns[known],
        "stamp_ns": np.array(batch.stamp_ns, np.int64)[known],
        "node": batch.node[known].astype(np.uint8),
        "orientation": batch.orientation[known],
        "orientation_stddev": np.stack([inclination, inclination, batch.heading_stddev], axis=1)[
            known
        ],
        "angular_velocity": batch.angular_velocity[known],
        "linear_acceleration": batch.acceleration[known],
    }


def _samples(columns: dict[str, np.ndarray], start_ns: int) -> list[TimedImuSample]:
    segments = list(NODES.values())
    orientation: FloatArray = columns["orientation"]
    rows = zip(
        columns["arrival_ns"].tolist(),
        columns["stamp_ns"].tolist(),
        columns["node"].tolist(),
        strict=True,
    )
    return [
        (
            start_ns + arrival_ns,
            ImuSample(
                stamp_ns=start_ns + stamp_ns,
                segment=segments[node],
                orientation=orientation[row],
                orientation_stddev=columns["orientation_stddev"][row],
                angular_velocity=columns["angular_velocity"][row],
                linear_acceleration=columns["linear_acceleration"][row],
            ),
        )
        for row, (arrival_ns, stamp_ns, node) in enumerate(rows)
    ]


def _keep(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write a file that is whole or absent; a disk that takes none costs nothing but time."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor, name = tempfile.mkstemp(prefix=".imu-", suffix=".npz", dir=path.parent)
        with os.fdopen(descriptor, "wb") as file:
            np.savez(file, **columns)  # type: ignore[arg-type]
        os.replace(name, path)
    except OSError:
        return


def _key(session: Session, parameters: ImuBridgeParameters) -> str:
    """What the samples depend on: the motion, the nodes, and the code that makes them."""
    settings = session.settings
    described = {
        "choreography": session.choreography,
        "duration": session.duration,
        "seed": session.seed,
        "scene": asdict(settings.scene),
        "variation": asdict(settings.variation),
        "imu": asdict(settings.imu),
        "bridge": asdict(parameters),
        "code": _code_digest(),
    }
    return hashlib.sha256(json.dumps(described, sort_keys=True).encode()).hexdigest()[:20]


@remembered
def _code_digest() -> str:
    digest = hashlib.sha256(np.__version__.encode())
    for path in (*_modules(imu_bridge), *_modules(pose_sim), Path(__file__)):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _modules(package: ModuleType) -> Iterable[Path]:
    return sorted(Path(package.__path__[0]).rglob("*.py"))
