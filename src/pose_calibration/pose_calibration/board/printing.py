"""Printing of the board in true size."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pose_calibration.board.target import CHARUCO, PAPERS, Board
from pose_core.errors import ParameterError, writing

INCH = 0.0254  # [m]
MARGIN = 0.008  # [m] not printed by printers
FOOT = 0.020  # [m] height of the ruler and the text
RULER = 0.1  # [m]
BITS = 6  # [-] cells across a marker of 4 x 4 bits with its border


def print_board(board: Board, path: Path, paper: str) -> None:
    """Write the board as a PDF page.

    Raises:
        InputError: If it cannot be written.
        ParameterError: If the board does not fit on the paper.
    """
    figure = board_figure(board, paper)
    with writing(path), matplotlib.rc_context({"pdf.fonttype": 42}):
        figure.savefig(path, format="pdf", metadata={"CreationDate": None})


def board_figure(board: Board, paper: str) -> Figure:
    """Draw the page in the paper's size; landscape if the board is wider than high.

    Raises:
        ParameterError: If the board does not fit.
    """
    short, long = PAPERS[paper]
    width, height = board.size
    page = (long, short) if width >= height else (short, long)
    room = page[0] - 2 * MARGIN, page[1] - 2 * MARGIN - FOOT
    if width > room[0] + 1e-9 or height > room[1] + 1e-9:
        p = board.parameters
        largest = min(room[0] / p.columns, room[1] / p.rows)
        raise ParameterError(
            f"a board of {width * 1e3:.0f} x {height * 1e3:.0f} mm does not fit on {paper}: "
            f"expected squares of {int(largest * 1e3)} mm or less, or larger paper"
        )
    figure = Figure(figsize=(page[0] / INCH, page[1] / INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, page[0])
    axes.set_ylim(page[1], 0.0)
    axes.set_axis_off()
    left = 0.5 * (page[0] - width)
    top = MARGIN + 0.5 * (room[1] - height)
    for x, y, side_x, side_y in _black_cells(board):
        axes.add_patch(Rectangle((left + x, top + y), side_x, side_y, color="black", linewidth=0))
    _draw_foot(axes, board, page, paper)
    return figure


def _black_cells(board: Board) -> list[tuple[float, float, float, float]]:
    """Black rectangles (x, y, width, height) [m] from the board's upper left corner."""
    p = board.parameters
    cells = [
        (column * p.square, row * p.square, p.square, p.square)
        for row in range(p.rows)
        for column in range(p.columns)
        if (row + column) % 2 == 0
    ]
    if p.board != CHARUCO:
        return cells
    marker = p.square * p.marker
    bit = marker / BITS
    dictionary = board.charuco.getDictionary()
    numbers = np.asarray(board.charuco.getIds()).ravel()
    places = np.asarray(board.charuco.getObjPoints(), float)
    for number, corners in zip(numbers, places, strict=True):
        image = dictionary.generateImageMarker(int(number), BITS)
        x, y = float(corners[:, 0].min()), float(corners[:, 1].min())
        for row, line in enumerate(image):
            for begin, end in _black_runs(line.tolist()):
                cells.append((x + begin * bit, y + row * bit, (end - begin) * bit, bit))
    return cells


def _black_runs(line: list[int]) -> list[tuple[int, int]]:
    """Start and end index of each run of black cells."""
    black = [False, *(value == 0 for value in line), False]
    edges = [i for i in range(len(line) + 1) if black[i] != black[i + 1]]
    return list(zip(edges[::2], edges[1::2], strict=True))


def _draw_foot(axes: Axes, board: Board, page: tuple[float, float], paper: str) -> None:
    """Draw a ruler to check the print's scale, and the board's description."""
    p = board.parameters
    y, x = page[1] - MARGIN - 0.6 * FOOT, 0.5 * (page[0] - RULER)
    axes.plot([x, x + RULER], [y, y], color="black", linewidth=0.6)
    for end in (x, x + RULER):
        axes.plot([end, end], [y - 0.002, y + 0.002], color="black", linewidth=0.6)
    text = (
        f"This line is {RULER * 1e3:.0f} mm long: print at 100 %, then measure it.   "
        f"{p.board}, {p.columns} x {p.rows} squares of {p.square * 1e3:g} mm"
        + (f", markers {p.marker * p.square * 1e3:g} mm" if p.board == CHARUCO else "")
        + f", {paper}. Glue it to something flat and stiff."
    )
    axes.text(0.5 * page[0], y + 0.007, text, ha="center", va="center", fontsize=7)
