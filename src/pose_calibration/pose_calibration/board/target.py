"""The board: a checkerboard, or a ChArUco board, whose corners are numbered."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from pose_core.api import FloatArray
from pose_core.errors import InputError, ParameterError
from pose_core.parameters import parameter

CHECKERBOARD, CHARUCO = "checkerboard", "charuco"
# Markers of few, large bits can be decoded in a depth camera's infrared image. The smaller
# dictionary is the first part of the larger one, and its markers differ more.
SMALL_DICTIONARY, LARGE_DICTIONARY, SMALL_COUNT = "DICT_4X4_50", "DICT_4X4_250", 50
OLDEST_OPENCV = (4, 8)
PAPERS = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "A2": (0.420, 0.594), "A1": (0.594, 0.841)}
"""Width and height [m], ISO 216."""


@dataclass(frozen=True, kw_only=True)
class BoardParameters:
    """Dimensions of the board."""

    board: str = parameter(
        CHARUCO,
        choices=(CHARUCO, CHECKERBOARD),
        doc="ChArUco may be partly hidden, a checkerboard may not",
    )
    columns: int = parameter(
        7, limits=(3, 30), doc="number of squares across, including the outermost"
    )
    rows: int = parameter(5, limits=(3, 30), doc="number of squares down, including the outermost")
    square: float = parameter(
        0.034, unit="m", limits=(0.005, 0.5), doc="side of a square, measured on the print"
    )
    marker: float = parameter(
        0.7, limits=(0.4, 0.95), doc="side of a ChArUco marker, relative to the square's"
    )

    def __post_init__(self) -> None:
        """Reject boards that are symmetric under a quarter turn."""
        if self.board == CHECKERBOARD and self.columns == self.rows:
            raise ParameterError(
                f"columns = rows = {self.rows}: a square checkerboard is the same from four sides, "
                "expected different numbers"
            )


class Board:
    """Geometry and markers of the board.

    Raises:
        InputError: If OpenCV is too old.
    """

    def __init__(self, parameters: BoardParameters) -> None:
        version = tuple(int(part) for part in cv2.__version__.split(".")[:2])
        if version < OLDEST_OPENCV:
            raise InputError(
                f"found OpenCV {cv2.__version__}, expected 4.8 or newer: install "
                "opencv-python-headless"
            )
        self.parameters = parameters

    @cached_property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """The board as OpenCV's object.

        Raises:
            ParameterError: If it has more squares than there are markers for.
        """
        p = self.parameters
        markers = p.columns * p.rows // 2
        name = SMALL_DICTIONARY if markers <= SMALL_COUNT else LARGE_DICTIONARY
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        if markers > len(dictionary.bytesList):
            raise ParameterError(
                f"{p.columns} x {p.rows} squares need {markers} markers, {name} has "
                f"{len(dictionary.bytesList)}: fewer squares"
            )
        return cv2.aruco.CharucoBoard(
            (p.columns, p.rows), p.square, p.square * p.marker, dictionary
        )

    @property
    def corner_count(self) -> int:
        """Number of inner corners."""
        return (self.parameters.columns - 1) * (self.parameters.rows - 1)

    @cached_property
    def corners(self) -> FloatArray:
        """Positions of the inner corners [m], (n, 3): x across, y down, z away from the viewer."""
        p = self.parameters
        y, x = np.mgrid[1 : p.rows, 1 : p.columns] * p.square
        return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        p = self.parameters
        return p.columns * p.square, p.rows * p.square
