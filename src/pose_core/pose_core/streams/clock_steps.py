"""Corrects the stamps of a recording's sources whose clock is set while they record.

The lag of a sample is its time of recording minus its stamp. A step of the stamps, after which the
lag is a different but steady one, is a clock's. A link that holds samples back changes the lag,
too, but their stamps go on without a step; if it then drops some, their stamps step forward, to a
lag that it had before.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_core.stamps import NS_PER_S

STEP_NS = 80_000_000  # [ns] least step; smaller ones are corrected by motion, or not noticed
LARGEST_NS = 86_400 * NS_PER_S  # [ns] a larger one is of a clock that had not been set before
STEADY_NS = NS_PER_S // 4  # [ns] variation of the lag after a step, and at most the step
USUAL = 300  # [samples] over which the usual lag is the median
AFTER = 30  # [samples] after a step that are judged
FEWEST = 5  # [samples] required of them
NEAR_NS = NS_PER_S // 2  # [ns] to the usual lag; others do not change it
SAME_NS = NS_PER_S // 2  # [ns] between steps of sources that share a clock


@dataclass(frozen=True)
class ClockStep:
    """A step of a source's clock."""

    source: str
    recorded_ns: int  # when it was recorded
    step_ns: int  # later minus earlier clock


@dataclass
class _Source:
    """State of one source's clock."""

    stamp_ns: int  # of its last sample, uncorrected
    recorded_ns: int
    usual_ns: float  # median lag of the corrected stamps
    least_ns: float  # the smallest that has been usual
    offset_ns: int = 0  # added to its stamps
    is_pending: bool = False  # whether a step at the end of the last batch is yet to be judged

    def follow(self, lags_ns: NDArray[np.int64]) -> None:
        """Follow the usual lag; samples that were held back are left out."""
        last = lags_ns[-USUAL:] - self.offset_ns
        near = last[np.abs(last - self.usual_ns) < NEAR_NS]
        if len(near):
            self.usual_ns = float(np.median(near))
            self.least_ns = min(self.least_ns, self.usual_ns)


class ClockSteps:
    """Finds steps of the sources' clocks, batch by batch."""

    def __init__(self) -> None:
        self._sources: dict[str, _Source] = {}
        self.steps: list[ClockStep] = []
        """Those found so far."""

    def offsets_ns(
        self, source: str, stamps_ns: Sequence[int], recorded_ns: Sequence[int]
    ) -> NDArray[np.int64]:
        """What to add to the stamps of a source's next samples, (n,) [ns].

        Args:
            source: The source's name.
            stamps_ns: Stamps of its next samples, (n,) [ns].
            recorded_ns: When they were recorded, (n,) [ns].
        """
        stamps, recorded = np.array(stamps_ns, np.int64), np.array(recorded_ns, np.int64)
        if not len(stamps):
            return stamps
        lags = recorded - stamps
        state = self._sources.get(source)
        if state is None:
            state = _Source(int(stamps[0]), int(recorded[0]), float(lags[0]), np.inf)
            self._sources[source] = state
        step = np.diff(stamps, prepend=state.stamp_ns)
        has_stepped = (step < 0) | (step - np.diff(recorded, prepend=state.recorded_ns) > STEP_NS)
        has_stepped[0] |= state.is_pending
        state.is_pending = False
        offsets = np.full(len(stamps), state.offset_ns)
        first = 0  # from which on the offset is the present one
        for k in np.flatnonzero(has_stepped).tolist():
            if k > first:
                state.follow(lags[first:k])
            after = lags[k : k + AFTER] - state.offset_ns
            change_ns = round(float(np.median(after)) - state.usual_ns)
            if not STEP_NS < abs(change_ns) < LARGEST_NS:
                continue
            if change_ns < 0 and np.median(after) > state.least_ns - STEP_NS:
                continue  # a link no longer holds samples back
            if len(after) < FEWEST:
                state.is_pending = True
                offsets[k:] = state.offset_ns + change_ns
            elif np.ptp(after) <= min(STEADY_NS, abs(change_ns)):
                self.steps.append(ClockStep(source, int(recorded[k]), -change_ns))
                state.offset_ns += change_ns
                offsets[k:] = state.offset_ns
                first = k
        state.follow(lags[first:])
        state.stamp_ns, state.recorded_ns = int(stamps[-1]), int(recorded[-1])
        return offsets

    def lines(self, begin_ns: int) -> list[str]:
        """One line for each step, of all the sources that made it.

        Args:
            begin_ns: Beginning of the recording [ns].
        """
        groups: list[list[ClockStep]] = []
        for step in self.steps:
            for group in groups:
                is_same = abs(step.step_ns - group[0].step_ns) < STEP_NS
                if is_same and abs(step.recorded_ns - group[0].recorded_ns) < SAME_NS:
                    group.append(step)
                    break
            else:
                groups.append([step])
        return [
            f"{', '.join(sorted(step.source for step in group))}: clock set by "
            f"{group[0].step_ns / NS_PER_S:+.2f} s at "
            f"{(group[0].recorded_ns - begin_ns) / NS_PER_S:.1f} s of the recording: later "
            "stamps are corrected by that"
            for group in groups
        ]
