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

BLOCK_NS = 500_000_000  # [ns] of each block only the earliest arrival is used
BLOCKS = 60  # [-] that the line is fitted to: half a minute
SKEW_BLOCKS = 4  # [-] required for a first estimate of the skew; until then it is 0
STEP_BLOCKS = 3  # [-] that must all be late before a step of the clocks is detected
STEP_NS = 20_000_000  # [ns] by which they must be late

Point = tuple[int, int]  # node time, arrival minus node time [ns]


class LowerLine:
    """The line below the arrivals of the last half minute.

    Args:
        max_skew: Largest relative difference between the two clocks [s/s].
        skew_blocks: Half seconds before a skew is estimated; until then it is 0.
        step_ns: Lasting delay of arrivals after a step of the clocks [ns].

    Attributes:
        skew: Relative rate of the host's clock to the node's, minus 1 [s/s].
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
        self._origin_ns = 0
        self._offset_ns = 0
        self.skew = 0.0

    @property
    def is_empty(self) -> bool:
        """Whether no arrival has been added yet."""
        return self._earliest is None

    def at(self, node_ns: int) -> int:
        """The line: host time minus node time, at a node time [ns]."""
        return self._offset_ns + round(self.skew * (node_ns - self._origin_ns))

    def add(self, node_ns: int, arrival_ns: int) -> bool:
        """Add an arrival, in order of node time; return whether the clocks stepped before it."""
        point = (node_ns, arrival_ns - node_ns)
        if self._earliest is None:
            self._begin(point, arrival_ns)
            self._origin_ns, self._offset_ns = point
            return False
        stepped = False
        if node_ns >= self._block_end_ns:
            self._blocks.append(self._earliest)
            self._begin(point, arrival_ns)
            stepped = self._has_stepped()
            self._lay()
        elif point[1] < self._earliest[1]:
            self._earliest = point
        # An arrival below the line lowers it at once.
        self._offset_ns += min(0, point[1] - self.at(node_ns))
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

    def _lay(self) -> None:
        """Fit the line to the blocks' earliest arrivals."""
        hull = _lower_hull(list(self._blocks))
        if len(self._blocks) < self._skew_blocks:
            self.skew = 0.0
        else:
            mean_ns = sum(point[0] for point in self._blocks) / len(self._blocks)
            left, right = next(pair for pair in itertools.pairwise(hull) if pair[1][0] >= mean_ns)
            skew = (right[1] - left[1]) / (right[0] - left[0])
            self.skew = max(-self._max_skew, min(self._max_skew, skew))
        self._origin_ns = self._blocks[-1][0]
        self._offset_ns = min(
            delay - round(self.skew * (node_ns - self._origin_ns)) for node_ns, delay in hull
        )


def _lower_hull(points: list[Point]) -> list[Point]:
    """The lower convex hull of points in order of time (Andrew's monotone chain)."""
    hull: list[Point] = []
    for x, y in points:
        while len(hull) > 1:
            (x0, y0), (x1, y1) = hull[-2:]
            if (x1 - x0) * (y - y0) > (x - x0) * (y1 - y0):
                break
            hull.pop()
        hull.append((x, y))
    return hull
