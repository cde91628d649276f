r"""Who wears the IMUs, or has come back with them, from the inclination of the limbs.

Cameras measure a limb's inclination as :math:`u \cdot b(t)`, with :math:`u` the vertical and
:math:`b` the limb's direction; an IMU on it measures :math:`a \cdot g(t)`, with :math:`g` the
vertical in the sensor and :math:`a` the limb's direction there. For an unknown constant :math:`a`,
and without any heading, person and IMU agree by the share of :math:`u \cdot b` that a linear
combination of :math:`g` explains:

.. math:: 1 - \min_{a, c} \sum_t (s - a \cdot g - c)^2 / \sum_t (s - \bar s)^2,
    \quad s = u \cdot b
"""

from collections.abc import Mapping

import numpy as np

from pose_core.arrays import FloatArray
from pose_core.joints import JOINT_INDEX, SEGMENT_ENDS
from pose_core.streams.samples import ImuBlock

MEMORY_S = 8.0  # [s] over which agreement fades
IMU_WITHIN_NS = 60_000_000  # [ns] of a frame
MIN_FRAMES = 60.0  # [-] of a limb
MIN_BEFORE, MIN_AFTER = 20.0, 20.0  # [-] frames of a limb before somebody left, and since they came
MAX_NUMBERS = 24  # [-] people of whom sums are kept
MIN_SWING = 0.05  # [-] standard deviation of a limb's inclination, over all limbs
MIN_AGREEMENT = 0.5  # [-] share of the motion that the IMUs explain
MIN_CONTINUED = 0.6  # [-] the same share of a newcomer's, with the constants of somebody known
MIN_LEAD = 0.2  # [-] by which they must explain one person's better than anybody else's


class WearerSearch:
    """Compares the IMUs' orientations with the motion of everybody's limbs."""

    def __init__(self) -> None:
        self._newest: dict[str, tuple[ImuBlock, int]] = {}  # sample by segment: block and row
        self._sums: dict[tuple[int, str], FloatArray] = {}  # normal equations, (5, 5)
        self._last_ns: dict[int, int] = {}

    def add_imus(self, block: ImuBlock) -> None:
        """Add IMU samples; only the newest of each is used."""
        for row, imu in enumerate(block.imu.tolist()):
            self._newest[block.segments[imu]] = block, row

    def add(self, number: int, stamp_ns: int, joints: FloatArray) -> None:
        """Add a person's joints in ``map`` [m], shape (15, 3)."""
        since_s = max(0, stamp_ns - self._last_ns.get(number, stamp_ns)) * 1e-9
        self._last_ns[number] = stamp_ns
        if len(self._last_ns) > MAX_NUMBERS:
            self._forget(min(self._last_ns, key=lambda each: self._last_ns[each]))
        fade = float(np.exp(-since_s / MEMORY_S))
        for segment, (block, index) in self._newest.items():
            is_near = abs(int(block.stamps_ns[index]) - stamp_ns) <= IMU_WITHIN_NS
            if segment not in SEGMENT_ENDS or not is_near:
                continue
            start, end = (JOINT_INDEX[name] for name in SEGMENT_ENDS[segment])
            limb = joints[end] - joints[start]
            length = float(np.sqrt(limb @ limb))
            if not length > 0.0:
                continue
            x, y, z, w = block.orientation[index].tolist()
            up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
            row = np.array([*up, 1.0, limb[2] / length])
            sums = self._sums.setdefault((number, segment), np.zeros((5, 5)))
            sums *= fade
            sums += row[:, None] * row

    def _forget(self, number: int) -> None:
        del self._last_ns[number]
        self._sums = {key: sums for key, sums in self._sums.items() if key[0] != number}

    def continues(self, known: int, newcomer: int) -> bool:
        """Whether the IMUs explain a newcomer's motion as they sat on somebody known.

        Nothing is fitted to the newcomer, so somebody else who moves alike has other constants.
        """
        swing = left = frames = 0.0
        for (number, segment), sums in self._sums.items():
            own = self._sums.get((newcomer, segment))
            if number != known or own is None or sums[3, 3] < MIN_BEFORE or own[3, 3] < MIN_AFTER:
                continue
            fitted = np.linalg.solve(sums[:4, :4] + 1e-3 * np.eye(4), sums[:4, 4])
            residual = np.array([*fitted, -1.0])
            left += float(residual @ own @ residual)
            swing += float(own[4, 4] - own[3, 4] ** 2 / own[3, 3])
            frames += float(own[3, 3])
        return swing > frames * MIN_SWING**2 and left < (1.0 - MIN_CONTINUED) * swing

    def agreements(self) -> Mapping[int, float]:
        """Share of the limbs' motion that the IMUs explain, by person [-]."""
        totals: dict[int, FloatArray] = {}
        for (number, _), sums in self._sums.items():
            count = sums[3, 3]
            if count < MIN_FRAMES:
                continue
            swing = sums[4, 4] - sums[3, 4] ** 2 / count
            normal, right = sums[:4, :4] + 1e-6 * np.eye(4), sums[:4, 4]
            left = sums[4, 4] - right @ np.linalg.solve(normal, right)
            totals.setdefault(number, np.zeros(3))[:] += swing, max(left, 0.0), count
        return {
            number: float(1.0 - left / swing)
            for number, (swing, left, count) in totals.items()
            if swing > count * MIN_SWING**2
        }

    def wearer(self) -> int | None:
        """The person who wears them; ``None`` if that is not clear."""
        agreements = self.agreements()
        if not agreements:
            return None
        best = max(agreements, key=lambda number: agreements[number])
        others = [value for number, value in agreements.items() if number != best]
        lead = agreements[best] - max(others, default=0.0)
        return best if agreements[best] > MIN_AGREEMENT and lead > MIN_LEAD else None
