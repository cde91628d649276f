r"""Who wears the IMUs: the person whose limbs move as they do.

How steeply a limb stands is told by both: by the cameras as :math:`u \cdot b(t)`, with :math:`u`
the vertical and :math:`b` the limb's direction, and by an IMU on it as :math:`a \cdot g(t)`, with
:math:`g` the vertical in the sensor and :math:`a` the limb's direction there. Whatever the unknown
constant :math:`a`, and without any heading, the share of :math:`u \cdot b` that a linear
combination of :math:`g` explains says how well a person and an IMU agree:

.. math:: 1 - \min_{a, c} \sum_t (s - a \cdot g - c)^2 / \sum_t (s - \bar s)^2,
    \quad s = u \cdot b
"""

from collections.abc import Mapping

import numpy as np

from pose_core.joints import JOINT_INDEX, SEGMENT_ENDS
from pose_core.streams.samples import FloatArray, ImuBlock

MEMORY_S = 8.0  # [s] over which agreement fades
FELT_WITHIN_NS = 60_000_000  # [ns] of a frame
LEAST_FRAMES = 60.0  # [-] of a limb
LEAST_SWING = 0.05  # [-] standard deviation of a limb's steepness, over all limbs
LEAST_AGREEMENT = 0.5  # [-] share of the motion that the IMUs explain
LEAST_LEAD = 0.2  # [-] by which they must explain one person's better than anybody else's


class WearerSearch:
    """Compares what IMUs feel with how everybody's limbs move."""

    def __init__(self) -> None:
        self._felt: dict[str, tuple[int, FloatArray]] = {}  # newest stamp, vertical in the sensor
        self._sums: dict[tuple[int, str], FloatArray] = {}  # normal equations, (5, 5)
        self._last_ns: dict[int, int] = {}

    def add_imus(self, block: ImuBlock) -> None:
        """Take what IMUs felt; of each the newest counts."""
        newest = {int(imu): row for row, imu in enumerate(block.imu)}
        for imu, row in newest.items():
            x, y, z, w = block.orientation[row]
            up = np.array(
                [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)]
            )
            self._felt[block.segments[imu]] = int(block.stamps_ns[row]), up

    def add(self, number: int, stamp_ns: int, joints: FloatArray) -> None:
        """Take where a person's joints are in ``map``, (15, 3) [m]."""
        since_s = max(0, stamp_ns - self._last_ns.get(number, stamp_ns)) * 1e-9
        self._last_ns[number] = stamp_ns
        fade = float(np.exp(-since_s / MEMORY_S))
        for segment, (felt_ns, up) in self._felt.items():
            if segment not in SEGMENT_ENDS or abs(felt_ns - stamp_ns) > FELT_WITHIN_NS:
                continue
            start, end = (JOINT_INDEX[name] for name in SEGMENT_ENDS[segment])
            limb = joints[end] - joints[start]
            length = float(np.sqrt(limb @ limb))
            if not length > 0.0:
                continue
            row = np.array([*up, 1.0, limb[2] / length])
            sums = self._sums.setdefault((number, segment), np.zeros((5, 5)))
            sums *= fade
            sums += np.outer(row, row)

    def agreements(self) -> Mapping[int, float]:
        """By person, the share of the limbs' motion that the IMUs explain."""
        totals: dict[int, list[float]] = {}
        for (number, _), sums in self._sums.items():
            count = sums[3, 3]
            if count < LEAST_FRAMES:
                continue
            swing = sums[4, 4] - sums[3, 4] ** 2 / count
            normal, right = sums[:4, :4] + 1e-6 * np.eye(4), sums[:4, 4]
            left = sums[4, 4] - right @ np.linalg.solve(normal, right)
            total = totals.setdefault(number, [0.0, 0.0, 0.0])
            total[0] += float(swing)
            total[1] += float(max(left, 0.0))
            total[2] += float(count)
        return {
            number: 1.0 - left / swing
            for number, (swing, left, count) in totals.items()
            if swing > count * LEAST_SWING**2
        }

    def wearer(self) -> int | None:
        """Who wears them, where that is clear."""
        agreements = self.agreements()
        if not agreements:
            return None
        best = max(agreements, key=lambda number: agreements[number])
        others = [value for number, value in agreements.items() if number != best]
        lead = agreements[best] - max(others, default=0.0)
        return best if agreements[best] > LEAST_AGREEMENT and lead > LEAST_LEAD else None
