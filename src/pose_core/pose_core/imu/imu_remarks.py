"""What is said of an IMU besides its alignment: what is wrong with its samples, and what to do."""

from dataclasses import replace

import numpy as np

from pose_core.imu.imu_set import ImuSet
from pose_core.imu.imu_use import ImuUse
from pose_core.stamps import NS_PER_S
from pose_core.streams.clocks import Clock

INVERSE_ORIENTATION = (
    "its orientation is the inverse, from the world to the sensor, or its quaternion is in the "
    "order w x y z: write the rotation from the sensor to its world, as x y z w"
)

Z_DOWN = "the z axis of its reference frame points down (NED): turned over; have it send z up (ENU)"

AGAINST_GYROSCOPE = (
    "its orientation jumps against its gyroscope, or stands still while that turns: see its filter"
)


def with_remarks(use: ImuUse, imus: ImuSet, clock: Clock, span_ns: tuple[int, int]) -> ImuUse:
    """The state of use of an IMU, with what is wrong with its samples.

    Args:
        use: Its state of use by the estimator.
        imus: All IMUs with samples.
        clock: Its own clock.
        span_ns: First and newest stamp of the pipeline [ns].
    """
    name = use.segment
    if name in imus.inverse:
        return ImuUse(segment=name, refused=INVERSE_ORIENTATION)
    if name in imus.history.slow:
        return ImuUse(segment=name, refused=_slow(imus.history.slow[name]))
    fault = imus.rates.faults.get(name)
    remarks = (
        _exchanged(use.exchanged_with),
        Z_DOWN if name in imus.z_down else "",
        f"its angular velocity {fault}; the orientation's change is used" if fault else "",
        f"its clock is {_ahead(clock)} the others': corrected" if clock.offset_ns else "",
        _disturbed(imus.walks.disturbed.get(name)),
        AGAINST_GYROSCOPE if name in imus.orientations.excluded else "",
        "" if use.refused else imus.silence(name, *span_ns),
    )
    return replace(use, start_ns=span_ns[0], remark="; ".join(filter(None, remarks)))


def _exchanged(other: str) -> str:
    """Where an exchanged IMU is worn, and what to do; empty for a segment's own."""
    if not other:
        return ""
    what = "exchange them on the body, or in the nodes file"
    return f"it is exchanged with that of {other}, and used there: {what}"


def _slow(rate: float) -> str:
    """Why an IMU with a low rate [Hz] is not used, and what to do."""
    return f"it sends {rate:.2g} samples a second, and at least 10 are needed: set 100 or more"


def _disturbed(walk: float | None) -> str:
    """What a heading's walk [rad/√s] tells; empty if it is usual."""
    if walk is None:
        return ""
    what = f"its heading walks by {np.degrees(walk):.0f}° within a second against its gyroscope"
    return f"{what}: keep metal and motors from its magnetic field, and tighten its strap"


def _ahead(clock: Clock) -> str:
    """How far a clock is ahead of another or behind it."""
    ahead_s = clock.offset_ns / NS_PER_S
    known = f" ± {clock.stddev_s:.2f}" if clock.stddev_s else ""
    return f"{abs(ahead_s):.2f}{known} s {'ahead of' if ahead_s > 0.0 else 'behind'}"
