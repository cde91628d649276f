"""Lines of text about a calibration, for the tools that print one."""

from collections.abc import Iterator

import numpy as np

from pose_core.api import Extrinsics


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
    ahead = (f"{name} {one.offset_ns / 1e6:+.0f} ms" for name, one in extrinsics.clocks.items())
    line = ", ".join(ahead)
    return f"clocks: ahead of {extrinsics.reference}'s {source}: {line}" if line else ""


def extrinsics_lines(extrinsics: Extrinsics) -> Iterator[str]:
    """Lines about extrinsics that were estimated from motion."""
    for name, pair in extrinsics.residuals.items():
        yield (
            f"extrinsics: '{name}' known to {np.degrees(pair.rotation_stddev):.1f}° and "
            f"{100.0 * pair.position_stddev:.1f} cm, agrees with '{pair.partner}' within "
            f"{100.0 * pair.median:.1f} cm"
        )
    for line in (clocks_line(extrinsics, "by the motion in the bag"), floor_line(extrinsics)):
        if line:
            yield line
