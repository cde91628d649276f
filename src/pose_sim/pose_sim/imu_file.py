"""The file ``imu.npz``: frames of the virtual serial device with their times."""

import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from imu_bridge.protocols.star import RawSample, encode
from pose_core.errors import InputError
from pose_sim.virtual_imu import RANGES, ImuFrames


def write(path: Path, frames: ImuFrames, note: str) -> None:
    """Write all frames, and a note on their origin."""
    np.savez(path, note=np.array(note), **asdict(frames))


def read(path: Path) -> tuple[ImuFrames, str]:
    """Read all frames and the note.

    Raises:
        InputError: If the file is missing or was not written by :func:`write`.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            columns = {name: archive[name] for name in ImuFrames.__dataclass_fields__}
            return ImuFrames(**columns), str(archive["note"])
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror or error}: expected a session's IMU file; "
            "'generate' makes one"
        ) from error
    except (KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path} is not a session's IMU file, or is cut off: make it again with 'generate'"
        ) from error


def encode_all(frames: ImuFrames) -> list[bytes]:
    """Encode every frame for transmission."""
    names = ("node_id", "sequence", "clock_us", "accelerometer", "gyroscope", "magnetometer")
    columns = [getattr(frames, name).tolist() for name in names]
    ranges: dict[str, Any] = {f"{sensor}_range": code for sensor, code in RANGES.items()}
    return [
        encode(RawSample(**dict(zip(names, row, strict=True)), magnetometer_valid=True, **ranges))
        for row in zip(*columns, strict=True)
    ]
