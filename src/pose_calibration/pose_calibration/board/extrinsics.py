"""Extrinsics from a board calibration; ``map`` from a board on the floor, or the mounting."""

import numpy as np

from pose_calibration.board.solution import BoardCalibration
from pose_calibration.floor.floor import KnownMounting, estimate_floor
from pose_calibration.floor.gravity import Gravity
from pose_core.api import BoardResiduals, Extrinsics
from pose_core.errors import InputError

ON_FLOOR = "board on the floor"
FLOOR_STDDEV = np.radians(0.5)  # [rad] of a board on a floor that is not exactly level
NOBODY = np.empty((0, 15, 3))


def board_extrinsics(
    calibration: BoardCalibration,
    mounting: KnownMounting | None = None,
    floor_instant: int | None = None,
) -> Extrinsics:
    """Extrinsics from the solution of a board calibration.

    Args:
        calibration: Poses of the cameras.
        mounting: Known tilt and height of the reference.
        floor_instant: Index of the instant at which the board lay on the floor.

    Raises:
        InputError: If that instant was not used.
    """
    gravity = None
    if floor_instant is not None:
        if floor_instant not in calibration.T_reference_board:
            reason = calibration.left_out.get(floor_instant, "there is no such view")
            raise InputError(f"view {floor_instant} cannot determine the floor: {reason}")
        T = calibration.T_reference_board[floor_instant]
        up = -T[:3, 2]  # the board's z points away from the viewer
        gravity = Gravity(up=up, stddev=float(FLOOR_STDDEV), source=ON_FLOOR)
        mounting = KnownMounting(height=float(-up @ T[:3, 3]))
    floor = estimate_floor(NOBODY, mounting, gravity)
    names = list(calibration.cameras)
    return Extrinsics(
        reference=names[0],
        T_reference_sensor=dict(calibration.T_reference_camera),
        T_map_reference=floor.T_map_reference,
        board={
            name: BoardResiduals(
                views=calibration.pairs[name],
                reprojection_px=calibration.rms_px,
                rotation_stddev=calibration.rotation_stddev[name],
                position_stddev=calibration.position_stddev[name],
            )
            for name in names[1:]
        },
        floor=floor,
    )
