"""Detection of sensors that were moved after the calibration.

Every second, the displacement of each sensor's view from the others' is computed: the median over
all joints. It does not depend on where a person stands or walks. When a tripod is moved, its view
has a lasting step: the camera's translation, or its rotation times the distance. After each second,
the last forty are split in two at each instant. A step between the medians of both parts was a
motion if it is eight times its standard deviation, by the scatter within both parts.

Once the views have agreed, only instants at which they are of one person count: near one another,
their postures agree; farther apart, no sensor's id of the person is a new one, or they have been
apart for half a minute. Trackers err differently for another person: after an absence, or with a
new id, only larger steps are reported until there is a baseline of this person.
"""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from pose_calibration.extrinsics.frame_memory import placed_positions
from pose_core.api import AlignedFrame, Extrinsics, FloatArray
from pose_core.finite_numbers import are_known, nan_median, robust_stddev
from pose_core.stamps import NS_PER_S

BLOCK_NS = NS_PER_S
MIN_FRAMES = 8  # [-] in a block
BLOCKS = 40  # [-] that are kept
MIN_BEFORE, MIN_AFTER = 12, 4  # [-] blocks before and after a motion
FEWEST = MIN_BEFORE + MIN_AFTER  # [-] blocks that are compared
CERTAIN = 8.0  # [-] smallest step in its standard deviations
MOST = 0.75  # [-] of the blocks after it have half of it or more
STDDEV_M = 0.001  # [m] added to its standard deviation
MOVED_M = 0.012  # [m] smallest step that is reported: 2 cm, less its noise
MOVED_SINCE_M = 0.03  # [m] the same, compared with a baseline that may be of another person
ABSENT_NS = 2 * NS_PER_S  # [ns] after which somebody in view may be another person
WRONG_M = 0.08  # [m] displacement of a whole baseline: the calibration was wrong from the start
AGREES = 0.5  # [-] of the reported step, below which the views agree again
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
        self._blocks: deque[FloatArray] = deque(maxlen=BLOCKS)
        self._before = np.zeros((len(self._sensors), 3))  # [m] displacements before the motion
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

    def moved_in(self, frames: Iterable[AlignedFrame]) -> Moved | None:
        """Add the instants of the calibration; returns a motion among them that spoils it.

        After a smaller step, their displacements are dropped: the poses may not be final.
        """
        for frame in frames:
            self._take(frame)
        if len(self._blocks) < FEWEST:
            return None
        found = self._find_step(np.stack(self._blocks), MOVED_M)
        if found is None or found.distance > WRONG_M:
            return found
        self._blocks.clear()
        return None

    def add(self, frame: AlignedFrame) -> Moved | None:
        """Add an instant; at the end of each second, returns a newly detected motion."""
        return self._compare() if self._take(frame) else None

    def _take(self, frame: AlignedFrame) -> bool:
        """Add an instant; whether a second ended that has a displacement."""
        end_ns = self._block_end_ns
        if end_ns is None or not -BLOCK_NS <= frame.stamp_ns - end_ns < BLOCK_NS:
            self._frames.clear()  # the first frame, or after a pause
            if end_ns is not None and abs(frame.stamp_ns - end_ns) > ABSENT_NS:
                self._own_blocks = 0
            end_ns = frame.stamp_ns + BLOCK_NS
        has_new = False
        if frame.stamp_ns >= end_ns:
            end_ns += BLOCK_NS
            if len(self._frames) >= MIN_FRAMES:
                self._blocks.append(nan_median(np.stack(self._frames)))
                self._own_blocks += 1
                has_new = True
            self._frames.clear()
        self._block_end_ns = end_ns
        off = self._differences(frame)
        displacement = nan_median(off.transpose(1, 0, 2))
        if np.isfinite(displacement).any() and self._is_one_person(frame, off, displacement):
            self._frames.append(displacement)
        return has_new

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
        """A new motion; ends an earlier one if the newest blocks are as before it."""
        blocks = np.stack(self._blocks)
        if self.moved is not None:
            apart = np.linalg.norm(nan_median(blocks[-MIN_AFTER:]) - self._before, axis=1)
            if np.nanmax(apart) < AGREES * self.moved.distance:
                self.moved = None
                self._blocks = deque(blocks[-MIN_AFTER:], BLOCKS)
            return None
        if len(blocks) < FEWEST:
            return None
        is_own = self._own_blocks >= FEWEST
        self.moved = self._find_step(blocks, MOVED_M if is_own else MOVED_SINCE_M)
        if is_own and self.moved is None:  # from now on, compare with this person alone
            self._blocks = deque(blocks[-self._own_blocks :], BLOCKS)
        return self.moved

    def _find_step(self, blocks: FloatArray, least: float) -> Moved | None:
        """The clearest motion within the blocks, or the displacement of all of them."""
        right_at_first = blocks - nan_median(blocks)  # as by a perfect calibration
        splits = range(MIN_BEFORE, len(blocks) - MIN_AFTER + 1)
        candidates = [(blocks[:split], blocks[split:], least) for split in splits]
        clearest, found = CERTAIN, None
        for before, after, smallest in [(right_at_first, blocks, WRONG_M), *candidates]:
            change = nan_median(after) - nan_median(before)
            step = np.linalg.norm(change, axis=1)
            is_clear = step > smallest
            along = ((after - nan_median(before)) * change).sum(axis=2) / np.maximum(step, 1e-9)
            is_clear &= np.quantile(along, 1.0 - MOST, axis=0) > 0.5 * step
            deviations = np.where(is_clear, step / _stddev_of_step(before, after), 0.0)
            worst = int(np.argmax(deviations))
            if deviations[worst] > clearest:
                clearest, self._before = deviations[worst], nan_median(before)
                # Of two sensors either may have moved.
                sensors = self._sensors if len(self._sensors) == 2 else (self._sensors[worst],)
                found = Moved(sensors=sensors, distance=float(step[worst]))
        return found


def _stddev_of_step(before: FloatArray, after: FloatArray) -> FloatArray:
    """Standard deviation [m] of the difference of two medians of blocks, (sensors,)."""
    residuals = [before - nan_median(before), after - nan_median(after)]
    scatter = np.linalg.norm(robust_stddev(np.concatenate(residuals)), axis=1)
    return np.asarray(scatter * np.sqrt(1.0 / len(before) + 1.0 / len(after)) + STDDEV_M)
