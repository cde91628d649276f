"""Checks the stamps of each source against their arrival times, before they are used.

A stamp is the time of capture. It cannot be later than the arrival or much earlier, and it cannot
decrease. A source that violates this is excluded. If its clock has jumped and then runs steadily
for a second, the source is used again with the new clock offset, so that only its usual lag
remains. A source whose samples may really be that old stays excluded: with a lag that a slow
network may cause, or with stamps that have gone on without a step while the lag grew, since the
link has held the samples back.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pose_core.counters import Counters
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import IMUS, Clock, Clocks, block_on_reference_clock
from pose_core.streams.samples import ImuBlock, SkeletonSample

CAMERA_LAG_NS = NS_PER_S // 2  # [ns] largest lag of a camera's sample
IMU_LAG_NS = NS_PER_S // 5  # [ns] largest lag of an IMU's sample
MAX_LEAD_NS = NS_PER_S // 10  # [ns] largest lead of a stamp over its arrival
SLOWEST_NS = 2 * NS_PER_S  # [ns] lag up to which samples may really be that old
MAX_OFFSET_NS = 5 * NS_PER_S  # [ns] of clocks, by which stamps of zero are corrected
ZERO = "stamps are zero: set header.stamp to the time of capture"
STEADY_NS = NS_PER_S  # [ns] for which a clock must run steadily after a jump
STEADY_SPREAD_NS = NS_PER_S // 10  # [ns] variation of its lag meanwhile
SAME_OFFSET_NS = NS_PER_S // 10  # [ns] within which two sources' offsets are taken as one clock's
MAX_PERIOD_NS = NS_PER_S // 2  # [ns] between samples; a larger step of stamps is a clock's
FEWEST = 8  # [samples] required of a steady clock
TOLERATED = 3  # [samples] that may be wrong before the source is excluded
STANDSTILL_NS = NS_PER_S // 5  # [ns] for which they may repeat a stamp
FORGIVEN = 0.5  # [samples] less for each good one: of two alternating clocks, half are wrong
USUAL_LAG_NS = 30_000_000  # [ns] initial value for a new source
LAG_MEMORY = 0.05  # [-] weight of a new lag in the usual lag
CAMERA_RATE, IMU_RATE = 120.0, 1000.0  # [Hz] to which faster streams are reduced
BURST_S = 0.1  # [s] of samples that may arrive at once
CLOCK_CHANGE_NS = NS_PER_S // 100  # [ns] smaller changes of a correction are a clock's drift
COUNTS = (
    "stamps_repeated",
    "stamps_backwards",
    "stamps_ahead",
    "stamps_too_old",
    "samples_thinned",
    "samples_set_aside",
    "clocks_set_aside",
    "clocks_taken_in_again",
)


@dataclass
class _Source:
    """State of one source's clock."""

    rate: float  # [Hz] to which it is reduced
    largest_lag_ns: int
    clock_ns: int | None = None  # added to its last stamp by the clocks of the calibration
    offset_ns: int = 0  # added to its stamps besides
    usual_lag_ns: float = USUAL_LAG_NS
    last_ns: int | None = None  # newest used stamp, with the offset
    newest_ns: int | None = None  # newest stamp of all, uncorrected
    has_stepped: bool = True  # whether the stamps since the last used one have a step
    has_run_back: bool = False  # whether that step was backwards
    tokens: float = 0.0  # [samples] that may arrive at once
    wrong: float = 0.0  # [samples] that were wrong, reduced by good ones
    new_stamp_ns: int = 0  # [ns] arrival of the last sample with a new stamp
    reason: str = ""  # why it is excluded
    is_behind: bool = False  # whether it is excluded only because its samples are too old
    trial_stamp_ns: int | None = None  # newest stamp of the steady run, uncorrected
    trial_since_ns: int = 0  # [ns] arrival at which the run began
    trial_lags_ns: list[int] = field(default_factory=list)  # lags of the run, without the offset


class StampCheck:
    """Passes the samples with plausible stamps, converted to the host's clock."""

    def __init__(self) -> None:
        self.counters = Counters(*COUNTS)
        self._sources: dict[str, _Source] = {}

    @property
    def excluded(self) -> Mapping[str, str]:
        """Reasons of the exclusion, by source."""
        return {name: each.reason for name, each in self._sources.items() if each.reason}

    @property
    def offsets_s(self) -> Mapping[str, float]:
        """Corrections of the stamps of sources whose clocks have jumped [s]."""
        sources = self._sources.items()
        return {name: each.offset_ns / NS_PER_S for name, each in sources if each.offset_ns}

    def skeleton(
        self, sample: SkeletonSample, arrival_ns: int, clocks: Clocks
    ) -> SkeletonSample | None:
        """A camera's sample with its stamp corrected, or None if it is rejected.

        Args:
            sample: The sample.
            arrival_ns: Time of arrival [ns], on the host's clock.
            clocks: Clocks that correct the stamps afterwards.
        """
        clock = clocks.get(sample.sensor, Clock())
        source = self._source(sample.sensor, CAMERA_RATE, CAMERA_LAG_NS)
        on_reference_ns = clock.to_reference(sample.stamp_ns)
        _follow_clock(source, on_reference_ns - sample.stamp_ns)
        if not self._judge(source, on_reference_ns, arrival_ns):
            return None
        offset_ns = source.offset_ns
        return replace(sample, stamp_ns=sample.stamp_ns + offset_ns) if offset_ns else sample

    def imus(self, block: ImuBlock, arrivals_ns: NDArray[np.int64], clocks: Clocks) -> ImuBlock:
        """IMU samples with their stamps corrected; see :meth:`skeleton`.

        Args:
            block: The samples.
            arrivals_ns: Their times of arrival (n,) [ns], on the host's clock.
            clocks: Clocks that correct the stamps afterwards.
        """
        on_reference_ns = block_on_reference_clock(block, clocks).stamps_ns
        sources = [self._source(f"{IMUS}/{name}", IMU_RATE, IMU_LAG_NS) for name in block.segments]
        changes_ns = on_reference_ns - block.stamps_ns
        for index, change_ns in dict(
            zip(block.imu.tolist(), changes_ns.tolist(), strict=True)
        ).items():
            _follow_clock(sources[index], change_ns)
        is_used = [
            self._judge(sources[index], stamp_ns, arrival_ns)
            for index, stamp_ns, arrival_ns in zip(
                block.imu.tolist(), on_reference_ns.tolist(), arrivals_ns.tolist(), strict=True
            )
        ]
        offsets_ns = np.array([source.offset_ns for source in sources], np.int64)
        block = replace(block, stamps_ns=block.stamps_ns + offsets_ns[block.imu])
        return block if all(is_used) else block.rows(np.flatnonzero(is_used))

    def _source(self, name: str, rate: float, largest_lag_ns: int) -> _Source:
        if name not in self._sources:
            self._sources[name] = _Source(rate, largest_lag_ns, tokens=rate * BURST_S)
        return self._sources[name]

    def _judge(self, source: _Source, stamp_ns: int, arrival_ns: int) -> bool:
        if arrival_ns == 0:  # simulated time has not begun
            self.counters.add("samples_set_aside")
            return False
        stamp = stamp_ns + source.offset_ns
        lag_ns = arrival_ns - stamp
        step_ns = stamp_ns - (source.newest_ns or 0)
        source.has_stepped |= not 0 <= step_ns <= MAX_PERIOD_NS
        source.has_run_back |= step_ns < 0
        source.newest_ns = stamp_ns
        fault = self._fault(source, stamp, lag_ns)
        has_stopped = arrival_ns - source.new_stamp_ns > STANDSTILL_NS
        if fault == "stamps_repeated" and not source.reason and not has_stopped:
            self.counters.add(fault)
            return False
        change = 1.0 if fault else -FORGIVEN
        source.wrong = min(max(source.wrong + change, 0.0), float(TOLERATED))
        if source.is_behind and source.wrong < TOLERATED - FORGIVEN:
            source.reason = ""
        if fault or source.reason:
            self._note_fault(source, fault, lag_ns, stamp_ns)
            self._try_offset(source, stamp_ns, arrival_ns)
            return False
        source.new_stamp_ns = arrival_ns
        source.has_stepped = source.has_run_back = False
        source.trial_stamp_ns = None
        elapsed_s = 0.0 if source.last_ns is None else (stamp - source.last_ns) / NS_PER_S
        source.tokens = min(source.tokens + elapsed_s * source.rate, source.rate * BURST_S)
        source.last_ns = stamp
        if source.tokens < 1.0:
            self.counters.add("samples_thinned")
            return False
        source.tokens -= 1.0
        source.usual_lag_ns += LAG_MEMORY * (lag_ns - source.usual_lag_ns)
        return True

    def _fault(self, source: _Source, stamp: int, lag_ns: int) -> str:
        if lag_ns < -MAX_LEAD_NS:
            return "stamps_ahead"
        if lag_ns > source.largest_lag_ns:
            return "stamps_too_old"
        if source.last_ns is not None and stamp <= source.last_ns:
            return "stamps_repeated" if stamp == source.last_ns else "stamps_backwards"
        return ""

    def _note_fault(self, source: _Source, fault: str, lag_ns: int, stamp_ns: int) -> None:
        self.counters.add(fault or "samples_set_aside")
        if not fault or (source.wrong < TOLERATED and fault != "stamps_repeated"):
            return
        if not source.reason:
            self.counters.add("clocks_set_aside")
            source.is_behind = True
        text = {
            "stamps_ahead": f"stamps are {-lag_ns / NS_PER_S:.1f} s ahead of their arrival",
            "stamps_too_old": f"stamps are {lag_ns / NS_PER_S:.1f} s behind their arrival",
            "stamps_repeated": "stamps stand still",
            "stamps_backwards": "stamps run backwards",
        }
        if source.offset_ns and fault in ("stamps_ahead", "stamps_too_old"):
            text[fault] = f"clock has jumped again, by {abs(lag_ns) / NS_PER_S:.1f} s"
        is_zero = fault == "stamps_too_old" and abs(stamp_ns) < MAX_OFFSET_NS
        source.reason = ZERO if is_zero else text[fault]
        source.is_behind &= fault == "stamps_too_old"

    def _try_offset(self, source: _Source, stamp_ns: int, arrival_ns: int) -> None:
        """Use the source again, with its new offset, once its clock has run steadily."""
        lags_ns, before_ns = source.trial_lags_ns, source.trial_stamp_ns
        lag_ns = arrival_ns - stamp_ns
        is_steady = (
            before_ns is not None
            and stamp_ns >= before_ns
            and max(*lags_ns, lag_ns) - min(*lags_ns, lag_ns) <= STEADY_SPREAD_NS
        )
        source.trial_stamp_ns = stamp_ns
        if not is_steady:
            source.trial_since_ns = arrival_ns
            source.trial_lags_ns = [lag_ns]
            return
        lags_ns.append(lag_ns)
        if arrival_ns - source.trial_since_ns < STEADY_NS or len(lags_ns) < FEWEST:
            return
        least_ns = min(lags_ns)
        corrected_ns = least_ns - source.offset_ns
        # A link holds samples back, but does not set their stamps back to what they should be.
        is_right_again = source.has_run_back and least_ns <= source.largest_lag_ns
        may_be_slow = not is_right_again and any(
            source.largest_lag_ns < each <= SLOWEST_NS for each in (least_ns, corrected_ns)
        )
        is_held_back = corrected_ns > source.largest_lag_ns and not source.has_stepped
        if may_be_slow or is_held_back:
            del lags_ns[: len(lags_ns) // 2]
            return
        self._readmit(source, least_ns)

    def _readmit(self, source: _Source, least_lag_ns: int) -> None:
        """Use a source again, with the offset that its stamps show now."""
        if -MAX_LEAD_NS <= least_lag_ns <= source.largest_lag_ns:
            offset_ns = 0  # its clock is correct again
        else:
            offset_ns = least_lag_ns - round(source.usual_lag_ns)
            for other in self._sources.values():
                is_same = other.offset_ns and abs(other.offset_ns - offset_ns) < SAME_OFFSET_NS
                if is_same and 0 <= least_lag_ns - other.offset_ns <= source.largest_lag_ns:
                    offset_ns = other.offset_ns
        self.counters.add("clocks_taken_in_again")
        source.offset_ns, source.reason = offset_ns, ""
        source.wrong = 0.0
        source.last_ns = source.trial_stamp_ns = None
        source.trial_lags_ns = []
        source.tokens = source.rate * BURST_S


def _follow_clock(source: _Source, clock_ns: int) -> None:
    """Reduce a source's offset by what its newly calibrated clock corrects."""
    before_ns, source.clock_ns = source.clock_ns, clock_ns
    if before_ns is None or abs(clock_ns - before_ns) < CLOCK_CHANGE_NS:
        return
    left_ns = source.offset_ns - (clock_ns - before_ns)
    is_corrected = source.offset_ns == 0 or abs(left_ns) <= MAX_LEAD_NS
    source.offset_ns = 0 if is_corrected else left_ns
    source.last_ns, source.wrong, source.trial_stamp_ns = None, 0.0, None
    source.newest_ns, source.has_stepped, source.has_run_back = None, True, False
