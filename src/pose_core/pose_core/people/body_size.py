"""How large a person is, as the sensors see them: what tells two persons apart."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pose_core.body.shape import BodyShape
from pose_core.joints import JOINT_INDEX, SIDES, TrackingState
from pose_core.streams.samples import FloatArray, SkeletonSample

BONES: dict[str, tuple[tuple[str, str], ...]] = {
    "thigh": tuple((f"{side}_hip", f"{side}_knee") for side in SIDES),
    "shank": tuple((f"{side}_knee", f"{side}_foot") for side in SIDES),
    "upper_arm": tuple((f"{side}_shoulder", f"{side}_elbow") for side in SIDES),
    "forearm": tuple((f"{side}_elbow", f"{side}_hand") for side in SIDES),
    "trunk": (("neck", "left_hip"), ("neck", "right_hip")),
}
"""The joints between which each length is measured; the two of a kind are averaged."""
OWN_SPREAD, COMMON_SPREAD = 0.045, 0.028
"""Standard deviations of logarithmic lengths over 1.5 s, against the same sensor's before: of each
bone, and of all bones together (five recordings of KinectMultiTrack; simulated trackers)."""
OTHER_OWN_SPREAD, OTHER_COMMON_SPREAD = 0.08, 0.04
"""The same against another sensor's, whose tracker has other mistakes."""
LEAST = 12  # [-] measurements of a bone before it counts
LEAST_BONES = 2  # [-] of five
OUTLYING = 4.0  # [-] variances: a bone that is farther off is hidden, and says no more than this
KEPT = 256  # [-] measurements of a sensor; beyond, every other one goes
SHAPE_JOINTS = ("left_knee", "left_foot", "left_elbow", "left_hand")
"""The joints whose distance from the one before is one of the first four lengths."""
SURE = 60  # [-] measurements before given measures are judged
LEAST_SHAPE_BONES = 3  # [-] of four
OTHER_BODY = 0.1  # [-] of the lengths, by which measures are somebody else's
_START, _END = (
    np.array([[JOINT_INDEX[pair[i]] for pair in pairs] for pairs in BONES.values()]) for i in (0, 1)
)


def log_lengths(sample: SkeletonSample) -> FloatArray:
    """Logarithm of each bone's length [m] where both its joints are tracked, else NaN; (5,)."""
    joints = np.where(
        (sample.tracking_state == TrackingState.TRACKED)[:, None], sample.positions, np.nan
    )
    lengths = np.linalg.norm(joints[_END] - joints[_START], axis=2)
    lengths[~(lengths > 0.01)] = np.nan
    known = np.isfinite(lengths)
    count = known.sum(axis=1)
    total = np.where(known, lengths, 0.0).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.log(np.where(count > 0, total / count, np.nan)))


@dataclass
class _Lengths:
    """What one sensor measures, thinned over time."""

    rows: list[FloatArray] = field(default_factory=list)  # (5,) each
    every: int = 1  # measurements of which one is kept
    left_out: int = 0

    def add(self, measured: FloatArray) -> None:
        self.left_out += 1
        if self.left_out < self.every:
            return
        self.left_out = 0
        self.rows.append(measured)
        if len(self.rows) > KEPT:
            self.rows, self.every = self.rows[::2], 2 * self.every

    def merge(self, other: "_Lengths") -> None:
        for row in other.rows:
            self.add(row)

    def median(self) -> FloatArray:
        """(5,); NaN where too little is known."""
        rows = np.array(self.rows).reshape(-1, len(BONES))
        count = np.isfinite(rows).sum(axis=0)
        return np.array(
            [np.nanmedian(rows[:, i]) if n >= LEAST else np.nan for i, n in enumerate(count)]
        )


class BodySize:
    """A person's bone lengths, as each sensor measures them."""

    def __init__(self) -> None:
        self._by_sensor: dict[str, _Lengths] = {}

    def add(self, sample: SkeletonSample) -> None:
        """Take one measurement."""
        lengths = self._by_sensor.setdefault(sample.sensor, _Lengths())
        lengths.add(log_lengths(sample))

    def merge(self, other: "BodySize") -> None:
        """Take all measurements of the same person's from elsewhere."""
        for sensor, lengths in other._by_sensor.items():
            self._by_sensor.setdefault(sensor, _Lengths()).merge(lengths)

    def disagreement(self, other: "BodySize") -> float:
        """How much two sizes differ, in standard deviations; NaN where too little is known."""
        shared = [name for name in self._by_sensor if name in other._by_sensor]
        off = _mean([self._by_sensor[s].median() - other._by_sensor[s].median() for s in shared])
        own_spread, common_spread = OWN_SPREAD, COMMON_SPREAD
        if np.isfinite(off).sum() < LEAST_BONES:
            off = self.mean() - other.mean()
            own_spread, common_spread = OTHER_OWN_SPREAD, OTHER_COMMON_SPREAD
        off = off[np.isfinite(off)]
        if len(off) < LEAST_BONES:
            return float("nan")
        # A difference common to all lengths is what distinguishes people best.
        common = float(np.median(off)) / common_spread
        own = float(np.mean(np.minimum((off / own_spread) ** 2, OUTLYING)))
        return float(np.sqrt(0.5 * (common**2 + own)))

    def mean(self) -> FloatArray:
        """Logarithm of each bone's length [m], mean of the sensors, (5,); NaN where unknown."""
        return _mean([lengths.median() for lengths in self._by_sensor.values()])

    @property
    def measurements(self) -> int:
        """How many there were, of all sensors; those that were thinned out are not counted."""
        return sum(len(lengths.rows) for lengths in self._by_sensor.values())


def _mean(rows: Sequence[FloatArray]) -> FloatArray:
    """Mean of the known values of each column; NaN where there is none."""
    if not rows:
        return np.full(len(BONES), np.nan)
    values = np.stack(rows)
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def is_of_size(size: BodySize, shape: BodyShape) -> bool | None:
    """Whether a person is as large as given measures say; None while too little is known."""
    lengths = shape.bone_lengths()
    given = np.array([np.log(lengths[joint]) for joint in SHAPE_JOINTS])
    off = size.mean()[: len(SHAPE_JOINTS)] - given
    off = off[np.isfinite(off)]
    if size.measurements < SURE or len(off) < LEAST_SHAPE_BONES:
        return None
    return bool(abs(np.median(off)) < OTHER_BODY)
