"""UTD-MHAD's skeletons: one Kinect v1, one action per file, MATLAB's ``.mat`` with ``d_skel``.

Chen, Jafari, Kehtarnavaz (2015), UTD-MHAD: A Multimodal Dataset for Human Action Recognition
Utilizing a Depth Camera and a Wearable Inertial Sensor, ICIP. ``d_skel`` has 20 joints × 3 [m] ×
frames, 30 Hz, without times and tracking states.
"""

import io
from pathlib import Path

import numpy as np

from pose_core.errors import InputError
from pose_core.stamps import NS_PER_S
from pose_io.recordings.formats.file_content import read_content
from pose_io.recordings.formats.format import Format
from pose_io.recordings.formats.sdk_rows import SdkRows
from pose_io.recordings.joint_map_files import shipped_joint_map
from pose_io.recordings.recording import Recording

NAME = "utd_mhad"
VARIABLE = "d_skel"
FRAME_RATE = 30.0  # [Hz] of a Kinect v1
PERSON = "0"
MAGIC = b"MATLAB 5.0 MAT-file"
MAX_BYTES = 64 * 1024 * 1024
JOINT_MAP = shipped_joint_map("utd_mhad")


def read(path: Path) -> Recording:
    """Read a file, see :class:`Format`."""
    # Imported here: scipy.io takes half a second to load, and only these recordings need it.
    from scipy.io import loadmat

    content = read_content(path, MAX_BYTES)
    try:
        found = loadmat(io.BytesIO(content), variable_names=[VARIABLE])
    except Exception as error:  # damaged files may raise any exception
        raise InputError(
            f"{path} is a damaged .mat ({type(error).__name__}): copy it again"
        ) from error
    skeleton = np.asarray(found.get(VARIABLE))
    expected = (len(JOINT_MAP.joints), 3)
    if skeleton.ndim != 3 or skeleton.shape[:2] != expected or skeleton.dtype.kind not in "fiu":
        raise InputError(
            f"{path} has no '{VARIABLE}' of {expected[0]} joints × 3 × frames: expected a skeleton "
            "file of UTD-MHAD, …_skeleton.mat"
        )
    rows = SdkRows()
    for frame, joints in enumerate(np.moveaxis(skeleton, -1, 0).astype(np.float64)):
        values = np.column_stack([joints, np.full(len(joints), np.nan)])
        rows.add(round(frame * NS_PER_S / FRAME_RATE), PERSON, values.tolist())
    return rows.recording(path, NAME, JOINT_MAP)


def recognise(_path: Path, begin: bytes) -> bool:
    """Whether a file is MATLAB's."""
    return begin.startswith(MAGIC)


FORMAT = Format(read=read, recognise=recognise)
