r"""The line below a stream of arrivals, which maps a device's clock to the host's.

A sample taken at node time :math:`n` arrives at host time :math:`a = (1 + s) n + o + d` with the
clocks' skew :math:`s`, their offset :math:`o` and a delay :math:`d \ge d_0`: the arrivals lie on or
above the line :math:`(1 + s) n + o + d_0`, and some of them close to it. That line is an edge of
the lower convex hull of the arrivals: the one over their mean, which of all lines below them has
the least sum of distances.

References:
    Moon, Skelly, Towsley (1999), INFOCOM, doi:10.1109/INFCOM.1999.749287: the least line below.
    Zhang, Liu, Xia (2002), INFOCOM, doi:10.1109/INFCOM.2002.1019257: by the convex hull.
"""

import itertools
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

BLOCK_NS = 500_000_000  # [ns] of each block only the earliest arrival is used
BLOCKS = 60  # [-] that the line is fitted to: half a minute
SKEW_BLOCKS = 4  # [-] required for a first estimate of the skew; until then it is 0
STEP_BLOCKS = 3  # [-] that must all be late before a step of the clocks is detected
STEP_NS = 20_000_000  # [ns] by which they must be late

Point = tuple[int, int]  # node time, arrival minus node time [ns]


class Line(NamedTuple):
    """Host time minus node time, linear in the node time."""

    skew: float = 0.0  # [s/s]
    origin_ns: int = 0  # [ns] node time
    offset_ns: int = 0  # [ns] at the origin

    def at(self, node_ns: int) -> int:
        """Host time minus node time, at a node time [ns]."""
        return self.offset_ns + round(self.skew * (node_ns - self.origin_ns))


def line_below(points: Sequence[Point], max_skew: float) -> Line:
    """The line below points that has the least sum of distances from them.

    Args:
        points: At least one, sorted.
        max_skew: Bound of the line's skew [s/s].
    """
    hull = _lower_hull(points)
    skew = 0.0
    if len(hull) > 1:
        mean_ns = sum(point[0] for point in points) / len(points)
        left, right = next(pair for pair in itertools.pairwise(hull) if pair[1][0] >= mean_ns)
        # The least sum is convex in the skew: within a bound it is at the bound.
        skew = (right[1] - left[1]) / (right[0] - left[0])
        skew = max(-max_skew, min(max_skew, skew))
    line = Line(skew, origin_ns=points[-1][0])
    return line._replace(offset_ns=min(delay - line.at(node_ns) for node_ns, delay in hull))


class LowerLine:
    """The line below the arrivals of the last half minute.

    Args:
        max_skew: Largest relative difference between the two clocks [s/s].
        skew_blocks: Half seconds before a skew is estimated; until then it is 0.
        step_ns: Lasting delay of arrivals after a step of the clocks [ns].
    """

    def __init__(
        self, max_skew: float, skew_blocks: int = SKEW_BLOCKS, step_ns: int = STEP_NS
    ) -> None:
        self._max_skew = max_skew
        self._skew_blocks = skew_blocks
        self._step_ns = step_ns
        self.restart()

    def restart(self) -> None:
        """Discard all arrivals."""
        self._blocks: deque[Point] = deque(maxlen=BLOCKS)
        self._block_end_ns = 0
        self._block_arrival_ns: deque[int] = deque(maxlen=STEP_BLOCKS + 1)
        self._earliest: Point | None = None  # of the current block
        self._line = Line()

    @property
    def skew(self) -> float:
        """Relative rate of the host's clock to the node's, minus 1 [s/s]."""
        return self._line.skew

    @property
    def is_empty(self) -> bool:
        """Whether no arrival has been added yet."""
        return self._earliest is None

    def at(self, node_ns: int) -> int:
        """The line: host time minus node time, at a node time [ns]."""
        return self._line.at(node_ns)

    def add(self, node_ns: int, arrival_ns: int) -> bool:
        """Add an arrival, in order of node time; return whether the clocks stepped before it."""
        point = (node_ns, arrival_ns - node_ns)
        if self._earliest is None:
            self._begin(point, arrival_ns)
            self._line = Line(origin_ns=node_ns, offset_ns=point[1])
            return False
        stepped = False
        if node_ns >= self._block_end_ns:
            self._blocks.append(self._earliest)
            self._begin(point, arrival_ns)
            stepped = self._has_stepped()
            is_long = len(self._blocks) >= self._skew_blocks
            self._line = line_below(self._blocks, self._max_skew if is_long else 0.0)
        elif point[1] < self._earliest[1]:
            self._earliest = point
        # An arrival below the line lowers it at once.
        lower_ns = self._line.offset_ns + min(0, point[1] - self.at(node_ns))
        self._line = self._line._replace(offset_ns=lower_ns)
        return stepped

    def _begin(self, point: Point, arrival_ns: int) -> None:
        self._earliest = point
        self._block_end_ns = point[0] + BLOCK_NS
        self._block_arrival_ns.append(arrival_ns)

    def _has_stepped(self) -> bool:
        """Whether a step of the host's clock, or lost samples, made the line invalid.

        A burst that a driver held back is late as well, but arrives all at once.
        """
        blocks = list(self._blocks)[-STEP_BLOCKS:]
        arrivals = self._block_arrival_ns
        spread = arrivals[-1] - arrivals[0] >= (STEP_BLOCKS - 1) * BLOCK_NS
        late = all(delay - self.at(node_ns) > self._step_ns for node_ns, delay in blocks)
        if len(self._blocks) <= STEP_BLOCKS or not (spread and late):
            return False
        self._blocks.clear()
        self._blocks.extend(blocks)
        return True


def _lower_hull(points: Sequence[Point]) -> list[Point]:
    """The lower convex hull of sorted points (Andrew's monotone chain)."""
    hull: list[Point] = []
    for x, y in points:
        if hull and x == hull[-1][0]:
            continue
        while len(hull) > 1:
            (x0, y0), (x1, y1) = hull[-2:]
            if (x1 - x0) * (y - y0) > (x - x0) * (y1 - y0):
                break
            hull.pop()
        hull.append((x, y))
    return hull
