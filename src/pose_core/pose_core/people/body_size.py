"""A person's body size as measured by the sensors, which distinguishes two persons."""

from dataclasses import dataclass, field

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.body.shape import BodyShape
from pose_core.finite_numbers import nan_mean, nan_median, robust_stddev
from pose_core.joints import JOINT_INDEX, SIDES
from pose_core.streams.samples import SkeletonSample

BONES: tuple[tuple[str, str], ...] = (
    *((f"{side}_hip", f"{side}_knee") for side in SIDES),
    *((f"{side}_knee", f"{side}_foot") for side in SIDES),
    *((f"{side}_shoulder", f"{side}_elbow") for side in SIDES),
    *((f"{side}_elbow", f"{side}_hand") for side in SIDES),
    ("neck", "left_hip"),
    ("neck", "right_hip"),
    ("left_shoulder", "right_shoulder"),
    ("left_hip", "right_hip"),
    ("neck", "head"),
    ("neck", "torso"),
    ("head", "left_hip"),
)
"""The joints between which lengths are measured; the first eight are of the body shape too."""
SPREADS = np.array([2.9, 2.9, 2.6, 2.6, 3.6, 3.6, 3.6, 3.9, 2, 2, 2.3, 3.9, 3.2, 3.2, 1.6]) / 100.0
"""Standard deviations of their logarithms over 1.5 s, against the same sensor's before, of joints
that the sensor sees well (KinectMultiTrack; people captured by CMU before simulated trackers)."""
COMMON_SPREAD = 0.015  # [-] of all of them together
SCATTER_FRAMES = 18.0  # [-] of 0.6 s, over which the error of a hidden joint stays the same
OTHER_SENSOR_SPREAD, OTHER_SENSOR_COMMON = 0.06, 0.04  # [-] in addition, against another sensor's
PEOPLE_SPREAD, PEOPLE_COMMON = 0.05, 0.07  # [-] in addition, from one person to another
FRAMES, FADING = 45.0, 0.35  # [-] of 1.5 s; power of their number with which the variances fall
STUDENT_DOF = 4.0  # [-] degrees of freedom of Student's distribution: hidden joints are far off
MIN_MEASUREMENTS = 8  # [-] measurements of a bone before it counts
MIN_BONES = 4  # [-]
MAX_KEPT = 256  # [-] measurements of a sensor; beyond, every other one goes
SHAPE_BONES = 8
JUDGED_MEASUREMENTS = 60  # [-] measurements before given measures are judged
MIN_SHAPE_BONES = 6  # [-]
OTHER_PERSON = 0.1  # [-] of the lengths, by which measures are somebody else's
_START, _END = (np.array([JOINT_INDEX[pair[i]] for pair in BONES]) for i in (0, 1))


def log_lengths(sample: SkeletonSample) -> FloatArray:
    """Logarithm of each bone's length [m] where both its joints are tracked, else NaN; (15,)."""
    joints = sample.tracked
    lengths = np.linalg.norm(joints[_END] - joints[_START], axis=1)
    return np.asarray(np.log(np.where(lengths > 0.01, lengths, np.nan)))


@dataclass
class _SensorLengths:
    """What one sensor measures, thinned over time."""

    rows: list[FloatArray] = field(default_factory=list)  # (15,) each
    every: int = 1  # measurements of which one is kept
    left_out: int = 0
    _summary: "_Summary | None" = None

    def add(self, measured: FloatArray) -> None:
        self.left_out += 1
        if self.left_out < self.every:
            return
        self.left_out = 0
        self._summary = None
        self.rows.append(measured)
        if len(self.rows) > MAX_KEPT:
            self.rows, self.every = self.rows[::2], 2 * self.every

    def merge(self, other: "_SensorLengths") -> None:
        for row in other.rows:
            self.add(row)

    def summary(self) -> "_Summary":
        """Medians of the measurements, their variance, and the number of frames."""
        if self._summary is None:
            rows = np.array(self.rows).reshape(-1, len(BONES))
            count = np.isfinite(rows).sum(axis=0)
            is_known = count >= MIN_MEASUREMENTS
            median = np.where(is_known, nan_median(rows), np.nan)
            scatter = robust_stddev(rows - median)
            frames = np.maximum(count * self.every, 1.0)
            variance = scatter**2 / np.maximum(frames / SCATTER_FRAMES, 1.0)
            self._summary = _Summary(median=median, variance=variance, frames=frames)
        return self._summary


@dataclass(frozen=True, kw_only=True)
class _Summary:
    """Logarithms of the bone lengths as one sensor measures them, (15,) each."""

    median: FloatArray  # NaN where too little is known
    variance: FloatArray  # of the median, by the scatter of the measurements
    frames: FloatArray  # in which the bone was measured


class BodySize:
    """A person's bone lengths, as each sensor measures them."""

    def __init__(self) -> None:
        self._by_sensor: dict[str, _SensorLengths] = {}

    def add(self, sample: SkeletonSample) -> None:
        """Take one measurement."""
        lengths = self._by_sensor.setdefault(sample.sensor, _SensorLengths())
        lengths.add(log_lengths(sample))

    def merge(self, other: "BodySize") -> None:
        """Take all measurements of the same person's from elsewhere."""
        for sensor, lengths in other._by_sensor.items():
            self._by_sensor.setdefault(sensor, _SensorLengths()).merge(lengths)

    def log_likelihood_ratio(self, other: "BodySize") -> float:
        """How much likelier these are one person's than two persons', log ratio; 0: unknown."""
        shared = [
            _sensor_log_likelihood_ratio(lengths, other._by_sensor[sensor])
            for sensor, lengths in self._by_sensor.items()
            if sensor in other._by_sensor
        ]
        known = [each for each in shared if each is not None]
        if known:
            return sum(known)
        variance = SPREADS**2 + OTHER_SENSOR_SPREAD**2
        common = COMMON_SPREAD**2 + OTHER_SENSOR_COMMON**2
        return _log_likelihood_ratio(self.mean() - other.mean(), variance, common) or 0.0

    def mean(self) -> FloatArray:
        """Logarithm of each bone's length [m], mean of the sensors, (15,); NaN where unknown."""
        medians = [lengths.summary().median for lengths in self._by_sensor.values()]
        return nan_mean(np.array(medians).reshape(-1, len(BONES)))

    @property
    def measurements(self) -> int:
        """How many there were, of all sensors; those that were thinned out are not counted."""
        return sum(len(lengths.rows) for lengths in self._by_sensor.values())


def _sensor_log_likelihood_ratio(one: _SensorLengths, other: _SensorLengths) -> float | None:
    """Log likelihood ratio of what one sensor measures of both."""
    first, second = one.summary(), other.summary()
    share = (FRAMES / first.frames) ** FADING + (FRAMES / second.frames) ** FADING
    variance = SPREADS**2 * share + first.variance + second.variance
    return _log_likelihood_ratio(
        first.median - second.median, variance, COMMON_SPREAD**2 * share.mean()
    )


def _log_likelihood_ratio(
    difference: FloatArray, variance: FloatArray, common_variance: float
) -> float | None:
    """Log likelihood ratio of a difference of lengths; None where too little is known."""
    known = np.isfinite(difference)
    if known.sum() < MIN_BONES:
        return None
    difference, variance = difference[known], variance[known]
    # A difference common to all lengths is what distinguishes people best.
    order = np.argsort(difference)
    weight = np.cumsum(1.0 / variance[order])
    common = float(difference[order][np.searchsorted(weight, 0.5 * weight[-1])])  # median
    own = difference - common
    common_variance += 1.5 / float((1.0 / variance).sum())
    ratio = _log_student(own, variance) - _log_student(own, variance + PEOPLE_SPREAD**2)
    variances = np.array([common_variance, common_variance + PEOPLE_COMMON**2])
    of_common = -0.5 * (common**2 / variances + np.log(variances))
    return float(ratio.sum() + of_common[0] - of_common[1])


def _log_student(difference: FloatArray, variance: FloatArray) -> FloatArray:
    """Logarithm of Student's density, but for a constant."""
    power = 0.5 * (STUDENT_DOF + 1.0)
    squared = difference**2 / (STUDENT_DOF * variance)
    return np.asarray(-power * np.log1p(squared) - 0.5 * np.log(variance))


def is_of_size(size: BodySize, shape: BodyShape) -> bool | None:
    """Whether a person is as large as given measures say; None while too little is known."""
    lengths = shape.bone_lengths()
    given = np.array([np.log(lengths[end]) for _, end in BONES[:SHAPE_BONES]])
    difference = size.mean()[:SHAPE_BONES] - given
    difference = difference[np.isfinite(difference)]
    if size.measurements < JUDGED_MEASUREMENTS or len(difference) < MIN_SHAPE_BONES:
        return None
    return bool(abs(np.median(difference)) < OTHER_PERSON)
