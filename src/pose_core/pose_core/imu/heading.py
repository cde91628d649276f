r"""Which way an IMU's world turns against map, followed while it drifts.

Without a magnetometer an IMU's world starts anywhere and turns slowly about the vertical, by what
is left of the gyroscope's bias. A Kalman filter follows the turn :math:`y` from the IMU's world to
map now, its drift :math:`\dot y`, the turn :math:`y_0` at the neutral pose, on which the mounting
rests, and how far beside their place the cameras see lateral axes. :math:`y_0` is measured through
its correlation with :math:`y` alone (a fixed-point smoother), so the mounting becomes better while
the drift is followed, and neither disturbs the other.

All IMUs' states are one filter's: joints show how neighbours' worlds are turned against each other
(:mod:`pose_core.imu.joints`), but for an offset, a state too, for what cameras see lastingly
beside, and for skin. Where no joint has shown anything, each IMU is followed by itself.

Measured is the angle about the vertical between where the IMU and where the cameras see one axis
point: of a limb's long axis the fresh part (:mod:`pose_core.kernels.fresh_part`), of a lateral
axis all of it. What is l long in the horizontal plane shows it with the standard deviation
:math:`\sigma / l`. Innovations are limited (Huber), so that a wrongly tracked joint does little. A
quick closed-form estimate over the last seconds runs beside it: it gives the first value, and
where both differ clearly for long, as after a device has begun anew, it replaces the slow one.
"""

import math

import numpy as np

from pose_core.kernels import heading as kernel
from pose_core.kernels.anchors import STATES, Y0, Anchors, Y, forget_covariance, make_anchors
from pose_core.streams.samples import FloatArray


class HeadingAnchor:
    """Heading of one IMU's world, its drift, and the heading at the neutral pose.

    Args:
        is_mounting_known: Whether the mounting rests on a calibration: then no heading at a neutral
            pose is sought, it is zero.
        anchors: Where it is kept, among other IMUs'; by itself if None.
        row: Which of those.
    """

    def __init__(
        self, *, is_mounting_known: bool = False, anchors: Anchors | None = None, row: int = 0
    ) -> None:
        self._anchors = make_anchors(1) if anchors is None else anchors
        self._row = row
        self._anchors.is_mounting_known[row] |= is_mounting_known

    def reset(self, *, is_mounting_known: bool = False) -> None:
        """Forget everything."""
        forget_covariance(self._anchors, self._row)
        for name, new in make_anchors(1)._asdict().items():
            if name != "covariance":
                getattr(self._anchors, name)[self._row] = new[0]
        self._anchors.is_mounting_known[self._row] = is_mounting_known

    @property
    def heading(self) -> float | None:
        """Turn [rad] about the vertical from the IMU's world to map; None if not yet observed."""
        return self._known(float(self._anchors.state[self._row, Y]))

    @property
    def neutral_heading(self) -> float | None:
        """The same turn [rad] at the neutral pose; 0 where the mounting is known otherwise."""
        if self._anchors.is_mounting_known[self._row]:
            return 0.0  # the mounting rests on no neutral pose
        return self._known(float(self._anchors.state[self._row, Y0]))

    @property
    def stddev(self) -> float:
        """Standard deviation [rad] of :attr:`heading`; π if not yet observed."""
        own = STATES * self._row + Y
        variance = float(self._anchors.covariance[own, own])
        return math.pi if self.heading is None else math.sqrt(variance)

    @property
    def recent(self) -> tuple[float, float]:
        """Recent sums of dot and cross products of the axis seen by IMU and cameras [s]."""
        dot, cross = self._anchors.recent[self._row].tolist()
        return dot, cross

    @property
    def restarts(self) -> int:
        """How often the world was found to have turned at once."""
        return int(self._anchors.restarts[self._row])

    def start(self, heading: float, stddev: float) -> None:
        """Begin with a heading [rad] and its standard deviation [rad]."""
        kernel.start(self._anchors, self._row, heading, stddev)

    def observe_standing(self, heading: float, stddev: float) -> None:
        """Take the heading [rad] that a neutral stand tells, where the mounting is known."""
        kernel.observe_standing(self._anchors, self._row, heading, stddev)

    def predict(self, dt_s: float) -> None:
        """Let the heading drift on for ``dt_s`` [s]."""
        kernel.predict(self._anchors, self._row, dt_s)

    def lose_heading(self) -> None:
        """The IMU's world may have turned to anywhere; the neutral pose's heading stays known."""
        kernel.lose_heading(self._anchors, self._row)

    def observe_lean(self, dt_s: float, axis_world: FloatArray, axis_map: FloatArray) -> None:
        """Compare where IMU and cameras see an axis that the neutral pose made known.

        Args:
            dt_s: Time [s] that this instant stands for.
            axis_world: The axis in the IMU's world, shape (3,).
            axis_map: The axis in map as the cameras see it, shape (3,).
        """
        kernel.observe_lean(
            self._anchors,
            self._row,
            dt_s,
            np.ascontiguousarray(axis_world),
            np.ascontiguousarray(axis_map),
        )

    def observe_turned(
        self, dt_s: float, axis_world: FloatArray, axis_map: FloatArray, sharpness: float
    ) -> None:
        """Compare an axis whose place in the sensor rests on :attr:`neutral_heading`.

        Such an axis, the trunk's lateral one or a bent knee's hinge, shows how far the world has
        turned since then.

        Args:
            dt_s: Time [s] that this instant stands for.
            axis_world: The axis in the IMU's world, shape (3,).
            axis_map: The axis in map as the cameras see it, shape (3,).
            sharpness: How well they see it [-]: 1 like a long axis, less in proportion.
        """
        kernel.observe_turned(
            self._anchors,
            self._row,
            dt_s,
            np.ascontiguousarray(axis_world),
            np.ascontiguousarray(axis_map),
            sharpness,
        )

    @staticmethod
    def _known(angle: float) -> float | None:
        return None if math.isnan(angle) else angle
