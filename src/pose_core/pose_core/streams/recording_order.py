"""Orders a recording's samples by their stamps, however late and by whichever clock they came.

Live, samples are used as they arrive. Of a recording, a frame waits for a second of later frames,
so that those of a sensor whose clock or network is behind, and the samples of IMUs, come in their
place. A single IMU whose clock is ahead then makes no other sample late.
"""

import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from heapq import heappop, heappush
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import JUMP_BACK_NS
from pose_core.streams.clocks import Clocks, block_on_reference_clock, reference_stamp_ns
from pose_core.streams.samples import (
    ImuBlock,
    ImuSample,
    SensorFrame,
    SkeletonSample,
    interleaved,
    joined,
)

WAIT_NS = JUMP_BACK_NS  # [ns] for which a frame waits; a longer step back is a new start
BATCH = 2000  # samples that are ordered together


class RecordingOrder:
    """Frames of all sensors and samples of all IMUs, in the order of their stamps.

    Args:
        clocks: Clocks that correct the stamps; the samples keep their own.
    """

    def __init__(self, clocks: Clocks) -> None:
        self._clocks = clocks
        self._newest_ns = 0  # no sample before the window's length from it is waited for
        self._frames: list[tuple[int, int, SensorFrame]] = []  # a heap by stamp, then by arrival
        self._count = 0
        self._imus: list[ImuBlock] = []
        self._ahead: Counter[str] = Counter()  # samples left out, by segment

    @property
    def left_out(self) -> Sequence[str]:
        """One line for each IMU with samples whose stamps are too far ahead of all others."""
        return [
            f"IMU {segment}: {count} samples left out: their stamps are more than a second ahead "
            "of all cameras': set the clock of what stamps them"
            for segment, count in sorted(self._ahead.items())
        ]

    def add(
        self, frames: Sequence[tuple[int, SensorFrame]], block: ImuBlock, places: NDArray[np.intp]
    ) -> Iterator[SensorFrame | ImuBlock]:
        """Add a batch of a recording.

        Args:
            frames: Its frames, each with its place among all samples; the places ascend.
            block: Its samples of IMUs.
            places: Their places, (n,), ascending.

        Yields:
            What need not wait any longer; of IMUs, the samples between two frames as one block.
        """
        start = 0
        for place, frame in frames:
            stamp_ns = self._newest_ns
            if frame:
                stamp_ns = reference_stamp_ns(frame[0], self._clocks)
            if stamp_ns < self._newest_ns - WAIT_NS:  # the recording begins anew
                stop = int(np.searchsorted(places, place))
                self._imus.append(block.rows(slice(start, stop)))
                yield from self.flush()
                start, self._newest_ns = stop, stamp_ns
            self._newest_ns = max(self._newest_ns, stamp_ns)
            self._count += 1
            heappush(self._frames, (stamp_ns, self._count, frame))
        if start < len(block):
            self._imus.append(block.rows(slice(start, None)))
            alone = int(np.searchsorted(places, frames[-1][0])) if frames else start
            last = block_on_reference_clock(self._imus[-1], self._clocks)
            passed_ns = [last.stamps_ns[last.imu == imu].max() for imu in np.unique(last.imu)]
            self._newest_ns = max(self._newest_ns, int(min(passed_ns)))  # by every IMU
            self._follow_imus(block.rows(slice(alone, None)))
        yield from self._ready(self._newest_ns - WAIT_NS)

    def flush(self) -> Iterator[SensorFrame | ImuBlock]:
        """What still waits."""
        yield from self._ready(np.iinfo(np.int64).max)

    def _ready(self, until_ns: int) -> Iterator[SensorFrame | ImuBlock]:
        """All samples up to an instant, in order."""
        block = joined(self._imus)
        stamps_ns = block_on_reference_clock(block, self._clocks).stamps_ns
        is_ahead = stamps_ns > self._newest_ns + WAIT_NS
        self._ahead.update(block.segments[imu] for imu in block.imu[is_ahead].tolist())
        order = np.argsort(stamps_ns, kind="stable")[: int(np.sum(~is_ahead))]
        block, stamps_ns = block.rows(order), stamps_ns[order]
        ready: list[tuple[int, int, SensorFrame]] = []
        while self._frames and self._frames[0][0] <= until_ns:
            ready.append(heappop(self._frames))
        until = [*(stamp_ns for stamp_ns, _, _ in ready), until_ns]
        *stops, count = np.searchsorted(stamps_ns, until, side="right")
        self._imus = [block.rows(slice(count, None))]
        frames = (frame for _, _, frame in ready)
        return interleaved(frames, block.rows(slice(count)), np.array(stops, np.intp))

    def _follow_imus(self, block: ImuBlock) -> None:
        """Advance along the samples after the cameras' last frame, up to the first long gap.

        An IMU that ends then does not put the others ahead; one whose clock is ahead stays so.
        """
        stamps_ns = np.sort(block_on_reference_clock(block, self._clocks).stamps_ns)
        for stamp_ns in stamps_ns[stamps_ns > self._newest_ns].tolist():
            if stamp_ns > self._newest_ns + WAIT_NS:
                break
            self._newest_ns = stamp_ns


def in_order(
    samples: Iterable[SkeletonSample | ImuSample | ImuBlock], clocks: Clocks
) -> Iterator[SkeletonSample | ImuBlock]:
    """One person's samples in the order of their stamps; see :class:`RecordingOrder`.

    Warns:
        UserWarning: If samples are left out; the text says why.
    """
    order, left = RecordingOrder(clocks), iter(samples)
    while batch := list(islice(left, BATCH)):
        frames: list[tuple[int, SensorFrame]] = []
        imus: list[ImuSample | ImuBlock] = []
        places: list[int] = []
        for place, each in enumerate(batch):
            if isinstance(each, SkeletonSample):
                frames.append((place, [each]))
            else:
                imus.append(each)
                places += [place] * (1 if isinstance(each, ImuSample) else len(each))
        found = order.add(frames, joined(imus), np.array(places, np.intp))
        yield from _one_by_one(found)
    yield from _one_by_one(order.flush())
    for line in order.left_out:
        warnings.warn(line, stacklevel=2)


def _one_by_one(samples: Iterable[SensorFrame | ImuBlock]) -> Iterator[SkeletonSample | ImuBlock]:
    for each in samples:
        if isinstance(each, ImuBlock):
            yield each
        else:
            yield from each
