"""Collection of views of the board from image streams until they suffice for a calibration."""

from collections.abc import Sequence

import numpy as np

from pose_calibration.board.detection import BoardDetector, BoardView, coverage
from pose_calibration.board.images import GreyImage
from pose_calibration.board.target import Board
from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S

LOOKED_EVERY_NS = 200_000_000  # [ns] between processed images of a camera: a detection takes 0.1 s
STILL_PX = 1.5  # [px] largest motion between images: cameras are not exactly simultaneous
DIFFERENT = 0.04  # [-] of the image's width: smallest distance to every stored view
ENOUGH_INSTANTS = 15  # [-] required instants at which a camera and another one see the board
ENOUGH_CELLS = 5  # [-] required of the image's 9 cells
MAX_INSTANTS = 60  # [-] more do not increase the accuracy


class BoardCollector:
    """Stores instants at which several cameras see the board at rest in a new pose.

    Args:
        board: The board to detect.
        cameras: The cameras' names.
        max_skew_s: Largest difference [s] of stamps within an instant.
    """

    def __init__(self, board: Board, cameras: Sequence[str], max_skew_s: float) -> None:
        self.cameras = tuple(cameras)
        self.instants: list[dict[str, BoardView]] = []
        self.counters = Counters(
            "images", "passed_over", "without_board", "moving", "seen_alone", "alike", "kept"
        )
        self._detector = BoardDetector(board)
        self._max_skew_ns = round(max_skew_s * NS_PER_S)
        self._looked_ns: dict[str, int] = {}
        self._before: dict[str, BoardView] = {}
        self._still: dict[str, tuple[int, BoardView]] = {}

    def add(self, camera: str, stamp_ns: int, image: GreyImage) -> bool:
        """Detect the board in an image; returns whether this completes a new instant."""
        self.counters.add("images")
        looked_ns = self._looked_ns.get(camera)
        if looked_ns is not None and 0 <= stamp_ns - looked_ns < LOOKED_EVERY_NS:
            self.counters.add("passed_over")
            return False
        self._looked_ns[camera] = stamp_ns
        view = self._detector.detect(image)
        before = self._before.pop(camera, None)
        self._still.pop(camera, None)
        if view is None:
            self.counters.add("without_board")
            return False
        self._before[camera] = view
        if before is None or _moved(before, view) > STILL_PX:
            self.counters.add("moving")
            return False
        self._still[camera] = stamp_ns, view
        instant = {
            name: one
            for name, (other_ns, one) in self._still.items()
            if abs(other_ns - stamp_ns) <= self._max_skew_ns
        }
        if len(instant) < 2:
            self.counters.add("seen_alone")
            return False
        return self.add_instant(instant)

    def add_instant(self, instant: dict[str, BoardView]) -> bool:
        """Store an instant unless it is similar to a stored one."""
        if len(self.instants) >= MAX_INSTANTS or any(
            set(instant) <= set(kept)
            and all(_moved(v, kept[c]) <= DIFFERENT * v.image_size[0] for c, v in instant.items())
            for kept in self.instants
        ):
            self.counters.add("alike")
            return False
        self.counters.add("kept")
        self.instants.append(instant)
        return True

    @property
    def progress(self) -> float:
        """Fraction of the required views, 0 to 1."""
        shared = [self._shared(camera) / ENOUGH_INSTANTS for camera in self.cameras]
        cells = [self._cells(camera) / ENOUGH_CELLS for camera in self.cameras]
        return float(np.minimum([shared, cells], 1.0).mean())

    @property
    def missing(self) -> str:
        """Instruction to the user; empty if the views suffice."""
        for camera in self.cameras:
            if self._cells(camera) < ENOUGH_CELLS:
                covered = coverage(self._views(camera))
                return f"hold the board where '{camera}' has it {covered.missing_text} of its image"
        fewest = min(self.cameras, key=self._shared)
        if self._shared(fewest) < ENOUGH_INSTANTS:
            return (
                f"hold the board still, elsewhere and tilted, where '{fewest}' and another see it: "
                f"{self._shared(fewest)} of {ENOUGH_INSTANTS} views"
            )
        return ""

    def _views(self, camera: str) -> list[BoardView]:
        return [instant[camera] for instant in self.instants if camera in instant]

    def _shared(self, camera: str) -> int:
        return len(self._views(camera))

    def _cells(self, camera: str) -> int:
        return int(coverage(self._views(camera)).cells.sum())


def _moved(before: BoardView, now: BoardView) -> float:
    """Median displacement [px] of the corners in both views; infinite if there are none."""
    common, first, second = np.intersect1d(before.corners, now.corners, return_indices=True)
    if len(common) == 0:
        return np.inf
    ways = np.linalg.norm(before.pixels[first] - now.pixels[second], axis=1)
    return float(np.median(ways))
