"""Camera poses from views of the board: li2020 (1), then bundle adjustment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pose_calibration.board.bundle import Bundle, BundleResult
from pose_calibration.board.camera import Camera, estimate_camera
from pose_calibration.board.detection import BoardView, ImageCoverage, coverage
from pose_calibration.board.target import Board
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.api import FloatArray, inverse, rigid_transform

MIN_PAIRS = 4  # [-] common instants required to link two cameras
FAR_M, FAR = 0.05, np.radians(2.5)  # [m], [rad] smallest distance of an outlier from the median
FAR_DEVIATIONS = 5.0  # [-] the same, in median absolute deviations
WORST_PX = 1.0  # [px] RMS above which a view may be left out
WORST_RATIO = 3.0  # [-] and this multiple of the median view's RMS
ROUNDS = 3  # solutions; between them bad views are left out
ALONE = "seen by only one camera, or none"

Instant = Mapping[str, BoardView]
"""Views of the board at one instant, by camera."""


@dataclass(frozen=True, kw_only=True)
class BoardCalibration:
    """Poses of the cameras with their uncertainty."""

    cameras: Mapping[str, Camera]  # the reference first
    T_reference_camera: Mapping[str, FloatArray]  # (4, 4) by camera
    T_reference_board: Mapping[int, FloatArray]  # (4, 4) by index of the instant
    rms_px: float  # reprojection
    rotation_stddev: Mapping[str, float]  # [rad]
    position_stddev: Mapping[str, float]  # [m]
    coverage: Mapping[str, ImageCoverage]
    pairs: Mapping[str, int]  # [-] instants used that each camera has in common with another
    left_out: Mapping[int, str] = field(default_factory=dict)  # reason, by index of the instant


def calibrate_board(
    board: Board, instants: Sequence[Instant], cameras: Mapping[str, Camera | None]
) -> BoardCalibration:
    """Estimate the poses of the cameras.

    Args:
        board: The board.
        instants: Views of the board at each instant, by camera.
        cameras: Intrinsics by camera, the reference first; None to estimate them.

    Raises:
        CalibrationError: If the views do not determine it; the message says what is missing.
    """
    known = {
        name: camera or estimate_camera(name, [v[name] for v in instants if name in v], board)
        for name, camera in cameras.items()
    }
    _check_sizes(instants, known)
    left_out = {i: ALONE for i, views in enumerate(instants) if len(views) < 2}
    T_camera_board = {
        (name, i): _board_pose(board, known[name], view)
        for i, views in enumerate(instants)
        if i not in left_out
        for name, view in views.items()
    }
    T_reference_camera = _linked(list(known), T_camera_board, left_out)
    used: list[int] = []
    for rounds_left in reversed(range(ROUNDS)):
        used = [i for i in range(len(instants)) if i not in left_out]
        T_reference_board = []  # by the camera that sees most of it
        for i in used:
            _, nearest = max((len(view.corners), name) for name, view in instants[i].items())
            T_reference_board.append(T_reference_camera[nearest] @ T_camera_board[nearest, i])
        bundle = Bundle(board, known, [instants[i] for i in used])
        T_camera_reference = {name: inverse(T) for name, T in T_reference_camera.items()}
        result = bundle.solve(T_camera_reference, np.array(T_reference_board))
        limit = max(WORST_PX, WORST_RATIO * float(np.median(list(result.errors_px.values()))))
        bad = {used[v] for (_, v), error in result.errors_px.items() if error > limit}
        if not bad or len(used) - len(bad) < MIN_PAIRS or not rounds_left:
            break
        left_out.update(dict.fromkeys(bad, "reprojects badly: blurred, bent, or not synchronous"))
    T_reference_camera = {name: inverse(T) for name, T in result.T_camera_reference.items()}
    alone = {
        i: T_reference_camera[name] @ _board_pose(board, known[name], view)
        for i, reason in left_out.items()
        if reason == ALONE
        for name, view in instants[i].items()
    }
    return BoardCalibration(
        cameras=known,
        T_reference_camera=T_reference_camera,
        T_reference_board=alone | dict(zip(used, result.T_reference_board, strict=True)),
        rms_px=result.rms_px,
        rotation_stddev=result.rotation_stddev,
        position_stddev=_with_focus(result, known),
        coverage={name: coverage(v[name] for v in instants if name in v) for name in known},
        pairs={name: sum(name in instants[i] for i in used) for name in known},
        left_out=left_out,
    )


def _check_sizes(instants: Sequence[Instant], cameras: Mapping[str, Camera]) -> None:
    for name, camera in cameras.items():
        sizes = {views[name].image_size for views in instants if name in views} - {
            camera.image_size
        }
        if sizes:
            raise CalibrationError(
                f"images of '{name}' have {min(sizes)} pixels, its intrinsics are of "
                f"{camera.image_size} ({camera.source}): give those of this image size"
            )


def _board_pose(board: Board, camera: Camera, view: BoardView) -> FloatArray:
    """``T_camera_board``: li2020's R_l, T_l."""
    # Two poses of a plane are nearly ambiguous from afar; IPPE gives both, the better one first.
    _, turn, shift = cv2.solvePnP(
        board.corners[view.corners],
        view.pixels,
        camera.K,
        camera.distortion,
        flags=cv2.SOLVEPNP_IPPE,
    )
    return rigid_transform(cv2.Rodrigues(turn)[0], shift.ravel())


def _linked(
    names: Sequence[str],
    T_camera_board: Mapping[tuple[str, int], FloatArray],
    left_out: dict[int, str],
) -> dict[str, FloatArray]:
    """``T_reference_camera`` along the pairs with the most common instants."""
    instants = sorted({i for _, i in T_camera_board})
    placed = {names[0]: np.eye(4)}
    while len(placed) < len(names):
        shared = {
            (a, b): [i for i in instants if (a, i) in T_camera_board and (b, i) in T_camera_board]
            for a in placed
            for b in names
            if b not in placed
        }
        a, b = max(shared, key=lambda pair: len(shared[pair]))
        common = [i for i in shared[a, b] if i not in left_out]
        if len(common) < MIN_PAIRS:
            raise CalibrationError(
                f"found {len(common)} instants at which '{a}' and '{b}' both see the board, "
                f"expected {MIN_PAIRS} or more: hold it where both see it"
            )
        words = np.array([T_camera_board[a, i] @ inverse(T_camera_board[b, i]) for i in common])
        T_a_b, far = _median_transform(words)
        outliers = [i for i, is_far in zip(common, far, strict=True) if is_far]
        left_out.update(dict.fromkeys(outliers, f"contradicts the others between '{a}' and '{b}'"))
        if (~far).sum() < MIN_PAIRS:
            raise CalibrationError(
                f"the views of '{a}' and '{b}' contradict each other: {far.sum()} of {len(far)} "
                "are far from the median; hold the board still at every image, and pair images "
                "that were taken together"
            )
        placed[b] = placed[a] @ T_a_b
    return placed


def _median_transform(words: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Mean of the consistent transforms, shape (n, 4, 4), and a mask of the outliers."""
    centre = np.median(words[:, :3, 3], axis=0)
    turns = Rotation.from_matrix(words[:, :3, :3])
    distances = np.array([(turns * turn.inv()).magnitude() for turn in turns])
    nearest = turns[int(np.argmin(np.median(distances, axis=1)))]
    off = np.linalg.norm(words[:, :3, 3] - centre, axis=1)
    turned = (turns * nearest.inv()).magnitude()
    far = off > np.maximum(FAR_M, FAR_DEVIATIONS * np.median(off))
    far |= turned > np.maximum(FAR, FAR_DEVIATIONS * np.median(turned))
    kept = ~far if (~far).any() else np.ones(len(far), bool)
    position = np.median(words[kept, :3, 3], axis=0)
    return rigid_transform(turns[kept].mean().as_matrix(), position), far


def _with_focus(result: BundleResult, cameras: Mapping[str, Camera]) -> dict[str, float]:
    """Standard deviations of the positions [m], including those of estimated focal lengths.

    A relative error of the focal length is the same relative error of the board's distance.
    """
    distance = float(np.median(np.linalg.norm(result.T_reference_board[:, :3, 3], axis=1)))
    by_focus = {name: distance * camera.focus_stddev for name, camera in cameras.items()}
    of_reference = next(iter(by_focus.values()))
    return {
        name: float(np.linalg.norm((stddev, of_reference, by_focus[name])))
        for name, stddev in result.position_stddev.items()
    }
