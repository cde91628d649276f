"""Detection of a board's corners in an image, and the part of the image that they cover."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pose_calibration.board.target import CHARUCO, Board
from pose_core.api import FloatArray

MIN_CORNERS = 6  # [-] required in a view
REFINED_WITHIN = 0.3  # [-] of a square's side: window of the refinement, without neighbours
ENLARGED_BELOW_PX = 1400  # [px] smaller images are enlarged: small markers are decoded better
NEXT_TO_MARKERS = 0.5  # [-] the same, of the white margin of a marker in its square
ROWS = ("top", "middle", "bottom")
COLUMNS = ("left", "centre", "right")


@dataclass(frozen=True, kw_only=True)
class BoardView:
    """The board's corners detected by one camera at one instant."""

    corners: NDArray[np.intp]  # (n,) indices of the board's corners
    pixels: FloatArray  # (n, 2) [px] positions in the image
    image_size: tuple[int, int]  # width, height [px]


@dataclass(frozen=True, kw_only=True)
class ImageCoverage:
    """Cells of a 3 x 3 grid over the image in which corners were detected."""

    cells: NDArray[np.bool_]  # (3, 3), rows from the top

    @property
    def share(self) -> float:
        """Share of the cells that contain corners [-]."""
        return float(self.cells.mean())

    @property
    def missing_text(self) -> str:
        """Description of the empty cells as part of a sentence."""
        empty = np.argwhere(~self.cells).tolist()
        places = ", ".join(f"{ROWS[row]} {COLUMNS[column]}" for row, column in empty)
        return f"at the {places}" if empty else "everywhere"


def coverage(views: Iterable[BoardView]) -> ImageCoverage:
    """Compute the coverage of an image by the corners of all views."""
    cells = np.zeros((3, 3), bool)
    for view in views:
        share = np.clip(view.pixels / view.image_size, 0.0, 1.0 - 1e-9)
        column, row = (share * 3).astype(int).T
        cells[row, column] = True
    return ImageCoverage(cells=cells)


class BoardDetector:
    """Detects the board."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._charuco: cv2.aruco.CharucoDetector | None = None
        if board.parameters.board == CHARUCO:
            markers = cv2.aruco.DetectorParameters()
            markers.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
            markers.minMarkerPerimeterRate = 0.01  # a marker of 0.025 m at 2 m has 5 px a side
            # Noise flips bits of small markers; wrong ones are rejected by their neighbours.
            markers.errorCorrectionRate = 1.0
            markers.adaptiveThreshWinSizeMin, markers.adaptiveThreshWinSizeMax = 5, 45
            self._charuco = cv2.aruco.CharucoDetector(board.charuco, detectorParams=markers)

    def detect(self, image: NDArray[np.uint8]) -> BoardView | None:
        """Detect the board in a grey image, (height, width); None if too few corners are found."""
        height, width = image.shape
        found = self._numbered(image) if self._charuco else self._checkerboard(image)
        if found is None or len(found[0]) < MIN_CORNERS:
            return None
        corners, pixels = found
        places = self._board.corners[corners]
        if np.linalg.matrix_rank(places - places[0]) < 2:
            return None  # a single row of corners does not determine a pose
        share = NEXT_TO_MARKERS * (1.0 - self._board.parameters.marker)
        refined = _refined(image, pixels, share if self._charuco else REFINED_WITHIN)
        return BoardView(corners=corners, pixels=refined, image_size=(width, height))

    def _numbered(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.intp], FloatArray] | None:
        assert self._charuco is not None
        scale = 2 if max(image.shape) < ENLARGED_BELOW_PX else 1
        large = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
        found, ids, _, _ = self._charuco.detectBoard(large)
        if ids is None or len(ids) == 0:
            return None
        # Pixel centres are whole numbers in both images.
        pixels = (np.asarray(found, float).reshape(-1, 2) + 0.5) / scale - 0.5
        return np.asarray(ids).reshape(-1).astype(np.intp), pixels

    def _checkerboard(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.intp], FloatArray] | None:
        p = self._board.parameters
        shape = (p.columns - 1, p.rows - 1)
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE  # corners are refined below, in a third of the time
        ok, pixels = cv2.findChessboardCornersSB(image, shape, flags=flags)
        if not ok:
            return None
        grid = np.asarray(pixels, float).reshape(p.rows - 1, p.columns - 1, 2)
        if self._is_turned(image, grid):
            grid = grid[::-1, ::-1]
        return np.arange(self._board.corner_count), grid.reshape(-1, 2)

    def _is_turned(self, image: NDArray[np.uint8], grid: FloatArray) -> bool:
        """Whether the corners are in the order of the board rotated by 180 degrees.

        It follows from the colour of the first square, unless columns and rows are both even or
        both odd: then the board is symmetric and assumed to be upright.
        """
        p = self._board.parameters
        if (p.columns + p.rows) % 2 == 0:
            return bool((grid[:, -1] - grid[:, 0]).mean(axis=0)[0] < 0.0)
        centres = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:])
        at = np.round(centres).astype(int)
        brightness = image[
            at[..., 1].clip(0, image.shape[0] - 1), at[..., 0].clip(0, image.shape[1] - 1)
        ]
        rows, columns = np.indices(brightness.shape)
        black = (rows + columns) % 2 == 0  # square (1, 1), right below the first corner
        return bool(brightness[black].mean() > brightness[~black].mean())


def _refined(image: NDArray[np.uint8], pixels: FloatArray, share: float) -> FloatArray:
    """Refine corners to subpixel accuracy; the window is a share of the squares' side."""
    nearest = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)
    np.fill_diagonal(nearest, np.inf)
    half = max(2, round(share * float(np.median(nearest.min(axis=1)))))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    start = pixels.astype(np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(image, start.copy(), (half, half), (-1, -1), stop)
    found = np.asarray(found, float).reshape(-1, 2)
    lost = np.linalg.norm(found - pixels, axis=1) > half
    found[lost] = pixels[lost]
    return np.asarray(found, np.float64)
