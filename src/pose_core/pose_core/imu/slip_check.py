r"""Finds IMUs that have slipped on their segment, from what the cameras see of the segment.

An axis a of a segment, as the cameras measure it, has a constant direction in the axes of a sensor
that is fixed to the segment, :math:`u = R_{ws}^T R_z(\psi)^T a`. Its mean over the last seconds,
:math:`u_l`, is compared with that before, :math:`u_b`; a tracker's constant errors are in both. The
sensor has rotated by S, in its own axes, which maximises

.. math:: J(S) = \sum_{c,k} w_{ck}\, u_{l,ck} \cdot S\,u_{b,ck} + w_0\,\mathrm{tr}\,S

over all cameras c and axes k: the long axis, of legs also the hinge of the bent knee, of the trunk
the line through the shoulders. It has slipped if S explains the axes clearly better than no
rotation does, for each camera. The filter's own rotations are not used: an IMU that takes part has
turned them already.
"""

from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray, unit_vectors
from pose_core.imu.exchange_check import DIRECTION_STDDEV, INDEPENDENT_S, LATE_S
from pose_core.imu.imu_history import ImuMeasurements
from pose_core.imu.sensor_alignment import best_rotation
from pose_core.joints import JOINT_INDEX, JOINT_PAIRS, LEGS, SEGMENT_ENDS, SIDES
from pose_core.kernels.compiling import compiled, type_specialised
from pose_core.kernels.rotations import exponential, product
from pose_core.stamps import NS_PER_S

PERIOD_NS = 100_000_000  # [ns] between two frames of a camera that are used
BIN_NS = NS_PER_S  # [ns] of one partial sum
LAST_BINS = 7  # partial sums that are the last seconds
MEMORY_BINS = 30.0  # time constant of the mean before, in partial sums
HINGE_STDDEV = 0.2  # [rad] of a knee's axis, bent at a right angle
MIN_BEND = 0.3  # [-] sine of a knee's bend from which on its axis is used
MIN_LAST, MIN_BEFORE = 0.3, 0.6  # independent samples required
POSTURE_STDDEV = 0.12  # [rad] by which a mean differs from posture to posture
TRUNK_POSTURE_STDDEV = 0.15  # [rad] the same of trunk and pelvis: they are not rigid
MIN_RESULTANT = 0.75  # [-] length of the mean of an axis; one that scatters more is not judged
SLIP_STDDEV = 0.5  # [rad] prior of a slip
MIN_GAIN = 8.0  # [-] of the squared distance
MIN_SHARE = 0.43  # [-] of it, for each camera

_LEGS = {
    f"{side}_{segment}": leg
    for side, leg in zip(SIDES, LEGS, strict=True)
    for segment in ("thigh", "shank")
}
UNKNOWN = -1  # joint of an axis that a segment does not have


class SlipCheck:
    """Accumulates the segments' axes in the axes of their sensors."""

    def __init__(self) -> None:
        self._slipped: Sequence[str] = ()
        self._add_axes = type_specialised(add_axes)
        self._now: FloatArray  # (sensors, imus, 2, 4): weighted axes; weights
        self._before: FloatArray  # the same, before the last seconds
        self._restart((), 0, 0)

    def is_due(self, stamp_ns: int, segments: tuple[str, ...], sensors: Iterable[int]) -> bool:
        """Whether :meth:`add` needs an instant.

        Args:
            stamp_ns: The instant [ns].
            segments: Those with an IMU at that instant.
            sensors: The cameras with a frame at that instant.
        """
        is_next_bin = not -BIN_NS < stamp_ns - self._bin_ns < BIN_NS
        has_new = not self._row.keys() >= set(segments)
        return is_next_bin or has_new or any(self._is_frame_due(s, stamp_ns) for s in sensors)

    def _is_frame_due(self, sensor: int, stamp_ns: int) -> bool:
        """Whether a camera's last frame that was used is old enough."""
        return not 0 <= stamp_ns - self._last_ns[sensor] < PERIOD_NS

    def add(
        self, stamp_ns: int, positions: FloatArray, imus: ImuMeasurements, headings: FloatArray
    ) -> None:
        """Add one instant; the sums restart if there is a new IMU.

        Args:
            stamp_ns: The instant [ns]; that of a late frame is before the last one's.
            positions: Tracked joints by the cameras in map, with swapped sides exchanged,
                (sensors, 15, 3) [m]; NaN otherwise.
            imus: The IMUs at that instant.
            headings: Of their reference frames in map [rad], (imus,); NaN of those not aligned.
        """
        is_new = any(segment not in self._row for segment in imus.segments)
        if is_new or len(positions) != len(self._last_ns):
            known = tuple(sorted({*self._row, *imus.segments}))
            self._restart(known, len(positions), stamp_ns)
        if not -BIN_NS < stamp_ns - self._bin_ns < BIN_NS:
            self._begin_bin(stamp_ns)
            self._slipped = self._judge()
        due = [sensor for sensor in range(len(positions)) if self._is_frame_due(sensor, stamp_ns)]
        rows = np.array([self._row[segment] for segment in imus.segments], np.int64)
        for sensor in due:
            if not np.isfinite(positions[sensor, :, 0]).any():
                continue
            gap_s = abs(stamp_ns - self._last_ns[sensor]) / NS_PER_S
            self._last_ns[sensor] = stamp_ns
            self._add_axes(
                self._axes,
                rows,
                positions[sensor],
                headings,
                imus.R_world_sensor,
                imus.angular_velocity,
                min(gap_s / INDEPENDENT_S, 1.0),
                self._now[sensor],
            )

    def forget(self, segment: str) -> None:
        """Restart with a segment whose IMU is aligned anew."""
        if segment in self._row:
            row = self._row[segment]
            for sums in (self._before, self._now, *self._last):
                sums[:, row] = 0.0
            self._slipped = [each for each in self._slipped if each != segment]

    @property
    def slipped(self) -> Sequence[str]:
        """Segments whose IMU has slipped, as judged once a second."""
        return self._slipped if len(self._slipped) == 1 else ()  # of several, the cameras are wrong

    def _begin_bin(self, stamp_ns: int) -> None:
        self._bin_ns = stamp_ns
        if len(self._last) == LAST_BINS:
            self._before = np.exp(-1.0 / MEMORY_BINS) * self._before + self._last[0]
        self._last.append(self._now)
        self._now = np.zeros_like(self._now)

    def _judge(self) -> Sequence[str]:
        last, before = np.sum(self._last, axis=0), self._before
        information = 1.0 / DIRECTION_STDDEV**2
        is_known = last[..., 3] > MIN_LAST * information
        is_known &= before[..., 3] > MIN_BEFORE * information
        is_judged = is_known.any(axis=(0, 2))
        return [
            segment
            for segment, row in self._row.items()
            if is_judged[row]
            and _has_slipped(segment, last[:, row], before[:, row], is_known[:, row])
        ]

    def _restart(self, segments: tuple[str, ...], sensors: int, stamp_ns: int) -> None:
        """Restart with the IMUs of these segments; not every one has a sample at each instant."""
        self._row = {segment: row for row, segment in enumerate(segments)}
        self._bin_ns = stamp_ns
        self._slipped = ()
        self._last_ns = [0] * sensors
        self._now = np.zeros((sensors, len(segments), 2, 4))
        self._before = np.zeros_like(self._now)
        self._last: deque[FloatArray] = deque(maxlen=LAST_BINS)
        self._axes = np.full((len(segments), 2, 4), UNKNOWN)
        for row, name in enumerate(segments):
            if name in SEGMENT_ENDS:
                end, start = (JOINT_INDEX[joint] for joint in reversed(SEGMENT_ENDS[name]))
                self._axes[row, 0, :2] = end, start
            if name in _LEGS:
                hip, knee, foot = _LEGS[name]
                self._axes[row, 1] = hip, knee, knee, foot
            if name == "torso":
                left, right = JOINT_PAIRS["shoulder"]
                self._axes[row, 1, :2] = right, left


@compiled
def add_axes(
    axes: NDArray[np.int64],
    rows: NDArray[np.int64],
    joints: FloatArray,
    headings: FloatArray,
    R_world_sensor: FloatArray,
    rates: FloatArray,
    share: float,
    sums: FloatArray,
) -> None:
    """Add the segments' axes of one camera's frame, in the axes of their sensors.

    Args:
        axes: Of each row the joints from which and to which two axes lead, (rows, 2, 4), or
            :data:`UNKNOWN`; of a hinge, those of the two limbs that it is perpendicular to.
        rows: Row of each IMU, (imus,).
        joints: (15, 3) [m] in map; NaN if unknown.
        headings: Of the sensors' reference frames in map, (imus,) [rad]; NaN if unknown.
        R_world_sensor: (imus, 3, 3).
        rates: Angular velocities of the sensors, (imus, 3) [rad/s]: their axes are seen late.
        share: Independent samples that the frame stands for [-].
        sums: Weighted axes, and weights, (rows, 2, 4); updated.
    """
    R_map_world, R_map_sensor = np.empty((3, 3)), np.empty((3, 3))
    for imu in range(len(rows)):
        exponential(0.0, 0.0, headings[imu], R_map_world)
        product(R_map_world, R_world_sensor[imu], R_map_sensor)
        late_variance = LATE_S**2 * np.dot(rates[imu], rates[imu])
        for k in range(2):
            start, end, next_start, next_end = axes[rows[imu], k]
            if start == UNKNOWN:
                continue
            axis, variance = joints[end] - joints[start], DIRECTION_STDDEV**2
            length = np.sqrt(np.dot(axis, axis))
            if next_start != UNKNOWN:
                shank = joints[next_end] - joints[next_start]
                lengths = length * np.sqrt(np.dot(shank, shank))
                axis = np.cross(axis, shank)
                length = np.sqrt(np.dot(axis, axis))
                if not length > MIN_BEND * lengths:
                    continue
                variance = (HINGE_STDDEV * lengths / length) ** 2
            weight = share / (variance + late_variance)
            if not length > 0.0:
                continue
            seen = np.dot(axis, R_map_sensor) * (weight / length)
            if np.isfinite(seen[0] + seen[1] + seen[2]):
                for i in range(3):
                    sums[rows[imu], k, i] += seen[i]
                sums[rows[imu], k, 3] += weight


def _has_slipped(
    segment: str, last: FloatArray, before: FloatArray, is_known: NDArray[np.bool_]
) -> bool:
    """Whether a rotation explains one IMU's axes better, from the sums (sensors, 2, 4)."""
    posture_stddev = TRUNK_POSTURE_STDDEV if segment in ("torso", "pelvis") else POSTURE_STDDEV
    is_known = is_known & (np.linalg.norm(last[..., :3], axis=-1) > MIN_RESULTANT * last[..., 3])
    views = np.count_nonzero(is_known.any(axis=1))
    if views < min(len(is_known), 2):  # one camera of several errs as easily
        return False
    last, before = last[is_known], before[is_known]
    weight = 1.0 / (1.0 / last[:, 3] + 1.0 / before[:, 3] + posture_stddev**2)
    axis_last, axis_before = unit_vectors(last[:, :3]), unit_vectors(before[:, :3])
    # A single axis errs more easily.
    least = MIN_GAIN if len(last) > 1 else 2.0 * MIN_GAIN
    if 2.0 * weight @ (1.0 - (axis_last * axis_before).sum(axis=1)) <= least:
        return False  # not even a rotation that explains all axes would gain more
    outer = np.einsum("n,ni,nj->nij", weight, axis_last, axis_before)
    B = np.zeros((len(is_known), 3, 3))
    np.add.at(B, np.nonzero(is_known)[0], outer)
    S = best_rotation(B.sum(axis=0) + np.eye(3) / SLIP_STDDEV**2)
    gains = 2.0 * (np.einsum("ij,cij->c", S, B) - np.trace(B, axis1=1, axis2=2))
    gains = gains[is_known.any(axis=1)]
    return bool(gains.sum() > least and gains.min() > MIN_SHARE * least)
