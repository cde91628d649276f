r"""Bundle adjustment of cameras and boards: the smallest sum of squared reprojection errors.

.. math:: \min_{T_c, T_v} \sum_{c, v, k} \rho(\| p_{cvk} - \pi_c(T_c T_v\,P_k) \|^2)

with :math:`T_c` from the reference camera to camera :math:`c`, :math:`T_v` from the board to the
reference camera at instant :math:`v`, :math:`P_k` the board's corners, :math:`\pi_c` the
projection.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import approx_fprime, least_squares
from scipy.sparse import csr_matrix
from scipy.spatial.transform import Rotation

from pose_calibration.board.camera import Camera
from pose_calibration.board.detection import BoardView
from pose_calibration.board.target import Board
from pose_core.api import FloatArray, inverse, rigid_transform

SOFT_PX = 0.3  # [px] residual beyond which the loss is linear
CORNER_STDDEV_PX = 0.05  # [px] lower bound of a corner's standard deviation
MAX_EVALUATIONS = 60


@dataclass(frozen=True, kw_only=True)
class BundleResult:
    """Result of the bundle adjustment."""

    T_camera_reference: Mapping[str, FloatArray]  # (4, 4) by camera, the reference's an identity
    T_reference_board: FloatArray  # (views, 4, 4)
    errors_px: Mapping[tuple[str, int], float]  # RMS [px] by camera and view
    rms_px: float  # over all corners
    rotation_stddev: Mapping[str, float]  # [rad] about the least certain axis
    position_stddev: Mapping[str, float]  # [m] along the least certain axis


class Bundle:
    """The bundle adjustment problem.

    Args:
        board: The board.
        cameras: By name, the reference first.
        views: For each instant, the views by camera.
    """

    def __init__(
        self, board: Board, cameras: Mapping[str, Camera], views: Sequence[Mapping[str, BoardView]]
    ) -> None:
        self._cameras = cameras
        self._names = list(cameras)
        self._views = [
            (self._names.index(name), v, board.corners[view.corners], view.pixels)
            for v, instant in enumerate(views)
            for name, view in instant.items()
        ]
        self._count = 6 * (len(self._names) - 1)
        self._size = self._count + 6 * len(views)

    def solve(
        self, T_camera_reference: Mapping[str, FloatArray], T_reference_board: FloatArray
    ) -> BundleResult:
        """Refine an initial estimate.

        Args:
            T_camera_reference: (4, 4) by camera.
            T_reference_board: Of each view, (views, 4, 4).
        """
        poses = [T_camera_reference[name] for name in self._names[1:]]
        start = np.concatenate([_vector(T) for T in (*poses, *T_reference_board)])
        found = least_squares(
            self._residuals,
            start,
            self._jacobian,
            loss="soft_l1",
            f_scale=SOFT_PX,
            x_scale="jac",
            max_nfev=MAX_EVALUATIONS,
        )
        errors = self._residuals(found.x)
        J = self._jacobian(found.x)
        unknowns = min(self._size, len(errors) - 1)
        variance = max(CORNER_STDDEV_PX**2, float(errors @ errors) / (len(errors) - unknowns))
        covariance = variance * np.linalg.pinv((J.T @ J).toarray(), hermitian=True)
        T = {name: _matrix(self._camera_vector(found.x, c)) for c, name in enumerate(self._names)}
        stddev = {name: self._stddev(covariance, c, T[name]) for c, name in enumerate(self._names)}
        ends = np.cumsum([2 * len(points) for _, _, points, _ in self._views])[:-1]
        return BundleResult(
            T_camera_reference=T,
            T_reference_board=np.array(
                [_matrix(found.x[i : i + 6]) for i in range(self._count, self._size, 6)]
            ),
            errors_px={
                (self._names[camera], v): float(np.sqrt(2.0 * np.mean(part**2)))
                for (camera, v, _, _), part in zip(self._views, np.split(errors, ends), strict=True)
            },
            rms_px=float(np.sqrt(2.0 * np.mean(errors**2))),
            rotation_stddev={name: each[0] for name, each in stddev.items()},
            position_stddev={name: each[1] for name, each in stddev.items()},
        )

    def _camera_vector(self, x: FloatArray, camera: int) -> FloatArray:
        return np.zeros(6) if camera == 0 else x[6 * (camera - 1) : 6 * camera]

    def _residuals(self, x: FloatArray) -> FloatArray:
        return np.concatenate([each[0] for each in self._projections(x)])

    def _jacobian(self, x: FloatArray) -> csr_matrix:
        blocks = []
        for (camera, v, _, _), (residual, J) in zip(self._views, self._projections(x), strict=True):
            block = np.zeros((len(residual), self._size))
            if camera > 0:
                block[:, 6 * (camera - 1) : 6 * camera] = J[:, :6]
            begin = self._count + 6 * v
            block[:, begin : begin + 6] = J[:, 6:]
            blocks.append(block)
        return csr_matrix(np.concatenate(blocks))

    def _projections(self, x: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Reprojection errors of each view, (2 n,) [px], and their derivatives, (2 n, 12).

        Derivatives are by the camera's rotation vector and translation, then by the board's.
        """
        result = []
        for camera, v, points, pixels in self._views:
            model = self._cameras[self._names[camera]]
            own = self._camera_vector(x, camera)
            board = x[self._count + 6 * v : self._count + 6 * v + 6]
            turn, shift, *derivatives = cv2.composeRT(board[:3], board[3:], own[:3], own[3:])
            dr_db, dr_dtb, dr_dc, dr_dtc, dt_db, dt_dtb, dt_dc, dt_dtc = derivatives
            found, J = cv2.projectPoints(points, turn, shift, model.K, model.distortion)
            chain = np.block([[dr_dc, dr_dtc, dr_db, dr_dtb], [dt_dc, dt_dtc, dt_db, dt_dtb]])
            result.append(((found.reshape(-1, 2) - pixels).ravel(), J[:, :6] @ chain))
        return result

    def _stddev(self, covariance: FloatArray, camera: int, T: FloatArray) -> tuple[float, float]:
        """Standard deviations of a camera's rotation [rad] and of its position [m]."""
        if camera == 0:
            return 0.0, 0.0
        block = covariance[6 * (camera - 1) : 6 * camera, 6 * (camera - 1) : 6 * camera]
        J = approx_fprime(_vector(T), lambda vector: inverse(_matrix(vector))[:3, 3], 1e-6)
        place = J @ block @ J.T
        return (
            float(np.sqrt(max(0.0, np.linalg.eigvalsh(block[:3, :3])[-1]))),
            float(np.sqrt(max(0.0, np.linalg.eigvalsh(place)[-1]))),
        )


def _vector(T: FloatArray) -> FloatArray:
    return np.concatenate([Rotation.from_matrix(T[:3, :3]).as_rotvec(), T[:3, 3]])


def _matrix(vector: FloatArray) -> FloatArray:
    return rigid_transform(Rotation.from_rotvec(vector[:3]).as_matrix(), vector[3:])
