"""A camera's intrinsics: from a camera info file, a CameraInfo message, or from the views."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pose_calibration.board.detection import BoardView, coverage
from pose_calibration.board.target import Board
from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_core.api import FloatArray
from pose_core.errors import InputError
from pose_core.plain_yaml import read_yaml

MODELS = ("plumb_bob", "rational_polynomial", "")
MIN_VIEWS = 12  # [-] views required to estimate intrinsics
MIN_COVERAGE = 0.6  # [-] share of the image's cells required to estimate intrinsics
FOCUS_STDDEV = 0.004  # [-] relative, of the focal length; distances have the same relative error
MIN_TILT = np.radians(15.0)  # [rad] largest angle between views; equal views leave the focus open


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Projection of a camera: OpenCV's pinhole model with distortion."""

    image_size: tuple[int, int]  # width, height [px]
    K: FloatArray  # (3, 3) [px]
    distortion: FloatArray  # (n,) k1 k2 p1 p2 k3 … [-]
    source: str  # origin of the values, for messages
    focus_stddev: float = 0.0  # [-] relative, of the focal length; 0 if it was given


def camera_from_info(message: Any) -> Camera:
    """The camera of a ``sensor_msgs/CameraInfo`` (of ROS or of rosbags).

    Raises:
        InputError: If it is not calibrated, or of another distortion model.
    """
    K, D = np.array(message.k, float).reshape(3, 3), message.d
    return _checked_camera(
        "CameraInfo", message.width, message.height, K, D, message.distortion_model
    )


def load_camera(path: Path) -> Camera:
    """Read a camera info YAML, as ROS's ``camera_calibration`` writes it.

    Raises:
        InputError: If it is missing or not such a file.
    """
    try:
        document = read_yaml(path, "the camera info")
        K = np.array(document["camera_matrix"]["data"], float).reshape(3, 3)
        D = document["distortion_coefficients"]["data"]
        size = int(document["image_width"]), int(document["image_height"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"{path} is not a camera info ({error}): expected image_width, image_height, "
            "camera_matrix: {data: [9 numbers]}, distortion_coefficients: {data: […]}"
        ) from error
    return _checked_camera(str(path), *size, K, D, document.get("distortion_model", ""))


def estimate_camera(name: str, views: Sequence[BoardView], board: Board) -> Camera:
    """Estimate the intrinsics from many views of the board.

    Args:
        name: The camera's name, for errors.
        views: Views of the board, all of one image size.
        board: The board.

    Raises:
        CalibrationError: If the views do not determine them; the message says what is missing.
    """
    if len(views) < MIN_VIEWS:
        raise CalibrationError(
            f"found {len(views)} views of the board by '{name}', expected {MIN_VIEWS} or more to "
            "estimate its intrinsics: more images, or give its camera info"
        )
    covered = coverage(views)
    if covered.share < MIN_COVERAGE:
        raise CalibrationError(
            f"the board covers {covered.share:.0%} of the image of '{name}', expected "
            f"{MIN_COVERAGE:.0%} to estimate its intrinsics: hold it also "
            f"{covered.missing_text}, or give the camera info"
        )
    objects = [board.corners[view.corners].astype(np.float32) for view in views]
    images = [view.pixels.astype(np.float32) for view in views]
    size = views[0].image_size
    # Higher orders than k2 overfit where the board does not reach the image's corners.
    rms, K, D, turns, _, stddev, _, _ = cv2.calibrateCameraExtended(
        objects, images, size, np.eye(3), np.zeros(5), flags=cv2.CALIB_FIX_K3
    )
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    tilt = float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)).max())
    if tilt < MIN_TILT:
        raise CalibrationError(
            f"all views of '{name}' show the board within {np.degrees(tilt):.0f} deg of each "
            f"other, expected {np.degrees(MIN_TILT):.0f} or more to estimate its "
            "intrinsics: tilt it"
        )
    focus_stddev = float((stddev.ravel()[:2] / [K[0, 0], K[1, 1]]).max())
    if not focus_stddev < FOCUS_STDDEV:
        raise CalibrationError(
            f"the views leave the focal length of '{name}' uncertain by {focus_stddev:.1%}, "
            f"expected {FOCUS_STDDEV:.1%}: more views, tilted, near enough to fill the "
            "image; or give the camera info"
        )
    return Camera(
        image_size=size,
        K=np.asarray(K, float),
        distortion=np.asarray(D, float).reshape(-1),
        source=f"estimated from {len(views)} views, reprojection {rms:.2f} px",
        focus_stddev=focus_stddev,
    )


def _checked_camera(
    source: str, width: int, height: int, K: FloatArray, D: Sequence[float], model: str
) -> Camera:
    if model not in MODELS:
        raise InputError(
            f"{source}: distortion model '{model}', expected plumb_bob or rational_polynomial: "
            "rectify the images first"
        )
    try:
        distortion = np.asarray(D, float).reshape(-1)
    except (TypeError, ValueError) as error:
        raise InputError(f"{source}: distortion coefficients: {error}") from error
    if not (np.isfinite(K).all() and K[0, 0] > 0.0 and K[1, 1] > 0.0):
        raise InputError(f"{source} holds no intrinsics (focal length {K[0, 0]:g} px)")
    if not np.isfinite(distortion).all():
        raise InputError(f"{source}: distortion coefficients {distortion} are not finite")
    if len(distortion) not in (0, 4, 5, 8, 12, 14):
        raise InputError(
            f"{source}: {len(distortion)} distortion coefficients, expected 4, 5, 8, 12 or 14"
        )
    return Camera(
        image_size=(int(width), int(height)),
        K=K,
        distortion=distortion if len(distortion) else np.zeros(5),
        source=source,
    )
