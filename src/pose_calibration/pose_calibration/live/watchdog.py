"""Detection of sensors that were moved after the calibration.

Every second, the displacement of each sensor's view from the others' is computed: the median over
all joints. It does not depend on where a person stands or walks. When a tripod is moved, its view
has a lasting step: the camera's translation, or its rotation times the distance. The mean of the
last four seconds is compared with earlier such means. On recordings of persons who walk before two
Kinects this detects two to four times as many steps of 2 cm or 1 degree as single seconds do, with
fewer false alarms.

Once the views have agreed, only instants at which they are of one person count: near one another,
their postures agree; farther apart, no sensor's id of the person is a new one, or they have been
apart for half a minute. Trackers err differently for another person: after an absence, or with a
new id, only larger steps are reported until there is a baseline of this person.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pose_calibration.extrinsics.frame_memory import placed_positions
from pose_core.api import AlignedFrame, Extrinsics, FloatArray
from pose_core.finite_numbers import are_known, nan_median, robust_stddev
from pose_core.stamps import NS_PER_S

BLOCK_NS = NS_PER_S
MIN_FRAMES = 8  # [-] in a block
BASELINE_BLOCKS = 30  # [-] with which the newest ones are compared
MIN_BASELINE = 12  # [-] before anything is reported
NEWEST_BLOCKS = 4  # [-] that must agree
MIN_SHARE = 0.5  # [-] of their mean step, required of every one
MOVED_M = 0.012  # [m] smallest mean step that is reported: 2 cm, less its noise
MOVED_SINCE_M = 0.03  # [m] the same, compared with a baseline that may be of another person
ABSENT_NS = 2 * NS_PER_S  # [ns] after which somebody in view may be another person
DEVIATIONS = 6.0  # [-] smallest step in standard deviations of earlier means
WRONG_M = 0.08  # [m] displacement of a whole baseline: the calibration was wrong from the start
AGREES = 0.5  # [-] of the smallest step that is reported, below which the views agree again
POSTURE_M = 0.2  # [m] median joint's distance, less the displacement, between different postures
NEAR_M = 0.35  # [m] displacement from which on views with new ids may be of different people
APART_NS = 30 * NS_PER_S  # [ns] after which such views are believed to be of one person


@dataclass(frozen=True, kw_only=True)
class Moved:
    """A detected motion of a sensor."""

    sensors: tuple[str, ...]  # the moved one; of two sensors, both
    distance: float  # [m] displacement of the view

    def __str__(self) -> str:
        """Message to the user."""
        who = " or ".join(f"'{name}'" for name in self.sensors)
        return f"{who} has been moved: its view is {self.distance * 100.0:.1f} cm off"


class Watchdog:
    """Compares the sensors' views, placed by a calibration."""

    def __init__(self, extrinsics: Extrinsics) -> None:
        self.moved: Moved | None = None  # a motion, until the views agree again
        self._extrinsics = extrinsics
        self._sensors = extrinsics.sensors
        self._frames: list[FloatArray] = []
        self._block_end_ns: int | None = None
        self._blocks: deque[FloatArray] = deque(maxlen=BASELINE_BLOCKS + NEWEST_BLOCKS)
        self._before: list[FloatArray] = []  # blocks before the motion
        self._own_blocks = 0  # newest blocks, which are of the same person
        self._persons: dict[str, str] = {}  # each sensor's id when the views were last near
        self._near_ns = 0  # [ns] and when

    @property
    def displacement(self) -> Mapping[str, float]:
        """Current displacement of each view from the others [m], by sensor; empty at first."""
        if not self._blocks:
            return {}
        distance = zip(self._sensors, np.linalg.norm(self._blocks[-1], axis=1), strict=True)
        return {name: float(each) for name, each in distance if np.isfinite(each)}

    def add(self, frame: AlignedFrame) -> Moved | None:
        """Add an instant; at the end of each second, returns a newly detected motion."""
        end_ns = self._block_end_ns
        if end_ns is None or not -BLOCK_NS <= frame.stamp_ns - end_ns < BLOCK_NS:
            self._frames.clear()  # the first frame, or after a pause
            if end_ns is not None and abs(frame.stamp_ns - end_ns) > ABSENT_NS:
                self._own_blocks = 0
            end_ns = frame.stamp_ns + BLOCK_NS
        noticed = None
        if frame.stamp_ns >= end_ns:
            end_ns += BLOCK_NS
            if len(self._frames) >= MIN_FRAMES:
                self._blocks.append(nan_median(np.stack(self._frames)))
                self._own_blocks += 1
                noticed = self._compare()
            self._frames.clear()
        self._block_end_ns = end_ns
        off = self._differences(frame)
        displacement = nan_median(off.transpose(1, 0, 2))
        if np.isfinite(displacement).any() and self._is_one_person(frame, off, displacement):
            self._frames.append(displacement)
        return noticed

    def _differences(self, frame: AlignedFrame) -> FloatArray:
        """Each view's joints less the others' mean [m], (sensors, 15, 3)."""
        places = placed_positions(frame, self._sensors, self._extrinsics)
        is_known = are_known(places)
        filled = np.where(is_known[..., None], places, 0.0)
        others = is_known.sum(axis=0) - is_known
        mean = (filled.sum(axis=0) - filled) / np.maximum(others, 1)[..., None]
        return np.where((is_known & (others > 0))[..., None], places - mean, np.nan)

    def _is_one_person(
        self, frame: AlignedFrame, off: FloatArray, displacement: FloatArray
    ) -> bool:
        """Whether the views are of one person, by differences and their median over the joints."""
        posture = nan_median(np.linalg.norm(off - displacement[:, None], axis=2).T)
        persons = {name: sample.person for name, sample in frame.samples.items()}
        if np.nanmax(np.linalg.norm(displacement, axis=1)) < NEAR_M:
            if np.nanmax(posture) > POSTURE_M:
                return not self._persons
            if any(self._persons.get(name, person) != person for name, person in persons.items()):
                self._own_blocks = 0
            self._persons.update(persons)
            self._near_ns = frame.stamp_ns
        is_long_apart = frame.stamp_ns - self._near_ns > APART_NS
        return is_long_apart or all(
            self._persons.get(name, person) == person for name, person in persons.items()
        )

    def _compare(self) -> Moved | None:
        """Compare the newest blocks with those before, or before the last motion."""
        before, newest = list(self._blocks)[:-NEWEST_BLOCKS], list(self._blocks)[-NEWEST_BLOCKS:]
        before = self._before or before
        if len(before) < MIN_BASELINE:
            return None
        is_own = self._own_blocks >= MIN_BASELINE + NEWEST_BLOCKS
        least = MOVED_M if is_own else MOVED_SINCE_M
        known, self.moved = self.moved, self._judge(np.stack(before), np.stack(newest), least)
        self._before = before if self.moved else []
        if known and not self.moved:
            self._blocks = deque([*before, *newest], self._blocks.maxlen)
        elif self._own_blocks == MIN_BASELINE + NEWEST_BLOCKS and not self.moved:
            self._blocks = deque([*before, *newest][-self._own_blocks :], self._blocks.maxlen)
        return None if known else self.moved

    def _judge(self, before: FloatArray, newest: FloatArray, least: float) -> Moved | None:
        baseline = nan_median(before)
        threshold = np.maximum(least, DEVIATIONS * _scatter_of_means(before, baseline))
        wrong = np.maximum(WRONG_M, threshold)
        is_wrong = np.linalg.norm(baseline, axis=1) > wrong
        steps = newest - np.where(is_wrong[:, None], 0.0, baseline)
        mean = steps.mean(axis=0)
        step = np.linalg.norm(mean, axis=1)
        along = (steps * mean).sum(axis=2) / np.maximum(step, 1e-9)
        lasting = along.min(axis=0) > MIN_SHARE * step  # not an outlier of one second
        beyond = np.nan_to_num(step / np.where(is_wrong, wrong, threshold), nan=0.0)
        if self.moved is not None:
            return self.moved if beyond.max() > AGREES else None
        beyond *= lasting
        worst = int(np.argmax(beyond))
        if beyond[worst] < 1.0:
            return None
        # Of two views either may have moved; of three, the moved one has the largest displacement.
        sensors = self._sensors if len(self._sensors) == 2 else (self._sensors[worst],)
        return Moved(sensors=sensors, distance=float(step[worst]))


def _scatter_of_means(blocks: FloatArray, baseline: FloatArray) -> FloatArray:
    """Standard deviation [m] of the mean of four blocks in a row, along the worst axis, (sensors,).

    At least that of four independent blocks, since thirty blocks have few rows of four.
    """
    rows = np.lib.stride_tricks.sliding_window_view(blocks, NEWEST_BLOCKS, axis=0).mean(axis=-1)
    of_means, of_blocks = (robust_stddev(some - baseline).max(axis=1) for some in (rows, blocks))
    return np.fmax(of_means, of_blocks / np.sqrt(NEWEST_BLOCKS))
