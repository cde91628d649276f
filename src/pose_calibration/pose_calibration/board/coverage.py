"""Coverage of an image by views of the board."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_calibration.board.detection import BoardView

ROWS = ("top", "middle", "bottom")
COLUMNS = ("left", "centre", "right")


@dataclass(frozen=True, kw_only=True)
class ImageCoverage:
    """Cells of a 3 x 3 grid over the image in which corners were detected."""

    cells: NDArray[np.bool_]  # (3, 3), rows from the top

    @property
    def share(self) -> float:
        """Share of the cells that contain corners [-]."""
        return float(self.cells.mean())

    @property
    def missing(self) -> list[str]:
        """Descriptions of the empty cells."""
        return [
            f"{ROWS[row]} {COLUMNS[column]}" for row, column in np.argwhere(~self.cells).tolist()
        ]

    @property
    def missing_text(self) -> str:
        """Description of the empty cells as part of a sentence."""
        return "at the " + ", ".join(self.missing) if self.missing else "everywhere"


def coverage(views: Iterable[BoardView]) -> ImageCoverage:
    """Compute the coverage of an image by the corners of all views."""
    cells = np.zeros((3, 3), bool)
    for view in views:
        share = np.clip(view.pixels / view.image_size, 0.0, 1.0 - 1e-9)
        column, row = (share * 3).astype(int).T
        cells[row, column] = True
    return ImageCoverage(cells=cells)
