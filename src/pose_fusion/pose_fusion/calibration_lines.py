"""Lines of text about a calibration, for the tools that print one."""

from collections.abc import Iterator

import numpy as np

from pose_calibration.inertial.imu_clock import TRACKER_DELAY_S
from pose_core.api import IMUS, ONE_IMU, Clock, Clocks, Extrinsics

LARGE_DRIFT = 1e-4  # [-] that quartzes hardly have
CERTAIN = 3.0  # [-] standard deviations
MS_PER_MINUTE = 6e4  # [ms/min] of a drift of 1
SPLIT = f" (with trackers {1e3 * TRACKER_DELAY_S:.0f} ms late, which cannot be told from it)"
TRACKERS = " (with the difference of their trackers' delays)"


def floor_line(extrinsics: Extrinsics) -> str:
    """One line about the floor and the vertical; empty if they are not known."""
    floor = extrinsics.floor
    if floor is None:
        return ""
    height = f"{floor.height:.2f}"
    if np.isfinite(floor.height_stddev):
        height += f" ± {floor.height_stddev:.2f}"
    tilt_deg = round(np.degrees(floor.tilt), 1) + 0.0  # no "-0.0"
    return (
        f"'{extrinsics.reference}' stands {height} m above the floor, tilted down by "
        f"{tilt_deg:.1f} ± {np.degrees(floor.up_stddev):.1f}° (from: {floor.source})"
    )


def clocks_line(extrinsics: Extrinsics, source: str) -> str:
    """One line about the clocks, which are known from ``source``; empty if there are none."""
    ahead = [
        f"{name} {one.offset_ns / 1e6:+.0f} ms{_drift(one)}{_contents(name)}"
        for name, one in extrinsics.clocks.items()
    ]
    single = [line.removeprefix(ONE_IMU) for line in ahead if line.startswith(ONE_IMU)]
    line = ", ".join(line for line in ahead if not line.startswith(ONE_IMU))
    parts = [f"ahead of {extrinsics.reference}'s {source}: {line}"] if line else []
    parts += [f"ahead of the other IMUs' {source}: {', '.join(single)}"] if single else []
    return f"clocks: {'; '.join(parts)}" if parts else ""


def _contents(name: str) -> str:
    """What else a source's offset contains."""
    if name.startswith(ONE_IMU):
        return ""
    return SPLIT if name == IMUS else TRACKERS


def _drift(clock: Clock) -> str:
    """A clock's drift, if it is more than that of quartzes and certain."""
    if abs(clock.drift) < max(LARGE_DRIFT, CERTAIN * clock.drift_stddev):
        return ""
    return f" ({MS_PER_MINUTE * clock.drift:+.1f} ms a minute)"


def single_imu_lines(clocks: Clocks) -> Iterator[str]:
    """Lines about IMUs with a clock of their own."""
    for source, clock in clocks.items():
        if source.startswith(ONE_IMU):
            ahead = f"{clock.offset_ns * 1e-6:.0f} ± {clock.stddev_s * 1e3:.0f} ms"
            segment = source.removeprefix(ONE_IMU)
            yield f"the clock of the IMU on {segment} is {ahead} ahead of the other IMUs'"


def tracker_lines(extrinsics: Extrinsics) -> Iterator[str]:
    """Lines about too little motion, and about trackers that guess distances or the scale."""
    for name, pair in extrinsics.residuals.items():
        if pair.needs_motion:
            yield (
                f"there was little motion: '{name}' may be turned by "
                f"{2.0 * np.degrees(pair.rotation_stddev):.0f}°; give --extrinsics-file of "
                "these cameras, or let the person raise the arms sideways and walk about"
            )
        if pair.scale_differs:
            larger = "larger" if pair.scale > 1.0 else "smaller"
            yield (
                f"'{name}' shows the person {100.0 * abs(pair.scale - 1.0):.0f} % {larger} than "
                f"'{pair.partner}': one tracker's scale is wrong, and so are the poses of the "
                "cameras; set the person's height in the tracker, or calibrate with a board"
            )
        if pair.is_rough:
            yield (
                f"'{name}' and '{pair.partner}' still differ by {100.0 * pair.median:.0f} cm, as "
                "trackers that guess distances do: angles change little, but the poses of the "
                f"cameras may be wrong by {2.0 * np.degrees(pair.rotation_stddev):.0f}° and "
                f"{200.0 * pair.position_stddev:.0f} cm; calibrate with a board"
            )


def extrinsics_lines(extrinsics: Extrinsics, motion: str) -> Iterator[str]:
    """Lines about extrinsics that were estimated from ``motion``."""
    for name, pair in extrinsics.residuals.items():
        yield (
            f"extrinsics: '{name}' known to {np.degrees(pair.rotation_stddev):.1f}° and "
            f"{100.0 * pair.position_stddev:.1f} cm, agrees with '{pair.partner}' within "
            f"{100.0 * pair.median:.1f} cm"
        )
    yield from tracker_lines(extrinsics)
    clocks = clocks_line(extrinsics, f"by {motion}")
    yield from filter(None, (clocks, floor_line(extrinsics)))
