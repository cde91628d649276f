"""Images of a calibration board as cameras at known places would take them (synthetic)."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from pose_calibration.board.target import CHARUCO

SQUARE_PIXELS = 48
SUPERSAMPLED = 2
MARGIN = 1  # squares of white paper round the pattern


class Scene:
    """A board and cameras that look at it.

    Args:
        board: The board.
        cameras: By name, with intrinsics.
        T_reference_camera: By name.
    """

    def __init__(self, board, cameras, T_reference_camera):
        self.board, self.cameras, self.T = board, cameras, T_reference_camera
        pattern = _pattern(board)
        self.texture = np.pad(pattern, MARGIN * SQUARE_PIXELS, constant_values=255)
        self.texture = (30.0 + self.texture * (190.0 / 255.0)).astype(np.uint8)

        self._rays = {name: _rays(camera) for name, camera in cameras.items()}

    def image(self, camera, T_reference_board, rng, *, noise=2.0, blur=0.5, hidden=None):
        """A grey image; ``hidden`` (x0, y0, x1, y1) [m] of the board is covered by something."""
        model = self.cameras[camera]
        T = np.linalg.inv(self.T[camera]) @ T_reference_board
        width, height = model.image_size
        rays, shape = self._rays[camera]
        H = np.linalg.inv(T[:3, [0, 1, 3]])  # from a ray to the board's plane [m]
        x, y, w = H.astype(np.float32) @ rays
        with np.errstate(divide="ignore", invalid="ignore"):
            x, y = x / w, y / w
        scale = SQUARE_PIXELS / self.board.parameters.square
        at = [(c * scale + (MARGIN * SQUARE_PIXELS - 0.5)).reshape(shape) for c in (x, y)]
        seen = cv2.remap(
            self.texture, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=90
        )
        if hidden is not None:
            x0, y0, x1, y1 = hidden
            covered = (x > x0) & (x < x1) & (y > y0) & (y < y1)
            seen[covered.reshape(shape)] = 120
        image = cv2.resize(seen, (width, height), interpolation=cv2.INTER_AREA).astype(float)
        if blur:
            image = cv2.GaussianBlur(image, (0, 0), blur)
        return np.clip(image + rng.normal(0.0, noise, image.shape), 0, 255).astype(np.uint8)


def _rays(camera):
    """Rays (3, n) through parts of pixels, and the shape of their grid."""
    width, height = camera.image_size
    step = (np.arange(SUPERSAMPLED) + 0.5) / SUPERSAMPLED - 0.5
    u, v = np.meshgrid(
        (np.arange(width)[:, None] + step).ravel(), (np.arange(height)[:, None] + step).ravel()
    )
    pixels = np.stack([u.ravel(), v.ravel()], axis=1)[:, None]
    rays = cv2.undistortPoints(pixels, camera.K, camera.distortion).reshape(-1, 2).T
    return np.vstack([rays, np.ones(rays.shape[1])]).astype(np.float32), u.shape


def board_pose(board, x, y, z, tilt_x=0.0, tilt_y=0.0, roll=0.0):
    """``T_reference_board`` with the board's middle at (x, y, z) [m], tilted [deg]."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", [tilt_x, tilt_y, roll], degrees=True).as_matrix()
    T[:3, 3] = np.array([x, y, z]) - T[:3, :3] @ [*np.array(board.size) / 2, 0.0]
    return T


def board_poses(board, count, rng, distance=2.0):
    """Poses at which somebody might hold the board about a place that two cameras see."""
    return [
        board_pose(
            board,
            rng.uniform(-0.5, 0.5),
            rng.uniform(-0.35, 0.35),
            distance + rng.uniform(-0.5, 0.3),
            rng.uniform(-30, 30),
            rng.uniform(-15, 45),
            rng.uniform(-20, 20),
        )
        for _ in range(count)
    ]


def _pattern(board):
    """The board as an image without margin, black on white."""
    p = board.parameters
    if p.board == CHARUCO:
        shape = (p.columns * SQUARE_PIXELS, p.rows * SQUARE_PIXELS)
        return np.asarray(board.charuco.generateImage(shape, marginSize=0, borderBits=1))
    rows, columns = np.mgrid[: p.rows, : p.columns]
    squares = np.where((rows + columns) % 2 == 0, 0, 255).astype(np.uint8)
    return np.kron(squares, np.ones((SQUARE_PIXELS, SQUARE_PIXELS), np.uint8))
