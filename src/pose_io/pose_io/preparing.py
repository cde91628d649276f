"""Loading of the kernels that read serialised messages, before the first message arrives."""

import numpy as np

from pose_io.cdr.imu_bytes import imu_block
from pose_io.cdr.kernels import STAMP_SIZE, PersonPlaces
from pose_io.cdr.skeleton_bytes import read_joints


def prepare_reading() -> None:
    """Load the kernels by reading no messages once."""
    imu_block({})
    nothing = np.zeros(0, np.int64)
    places = PersonPlaces(stamp=0, positions=0, states=0, length=0, named=nothing, joints=nothing)
    read_joints(np.zeros((1, STAMP_SIZE), np.uint8), places, is_little=True)
