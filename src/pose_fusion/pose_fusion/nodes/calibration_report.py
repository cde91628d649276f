"""The calibration node's report in ``/diagnostics``."""

import numpy as np

from pose_calibration.live.live_calibration import CalibrationState, LiveCalibration
from pose_core.api import Extrinsics
from pose_core.counters import Counters
from pose_fusion.calibration_lines import tracker_lines
from pose_node.node_status import Level, Report


def calibration_report(calibration: LiveCalibration, counters: Counters, trouble: str) -> Report:
    """State, residuals and counters of a calibration.

    Args:
        calibration: The calibration.
        counters: The node's own counters.
        trouble: Why the file could not be saved; empty if it was.
    """
    collecting = calibration.state is CalibrationState.COLLECTING
    extrinsics = calibration.extrinsics
    scales = [] if extrinsics is None else list(tracker_lines(extrinsics))
    level = Level.WARN if collecting or calibration.moved or scales else Level.OK
    if trouble:
        level = Level.ERROR
    message = trouble or "; ".join([calibration.status, *scales])
    return Report(level=level, message=message, values=_values(calibration, counters))


def _values(calibration: LiveCalibration, counters: Counters) -> dict[str, object]:
    return {
        "state": calibration.state.value,
        "progress": f"{calibration.progress:.2f}",
        "missing": calibration.missing,
        "moved": calibration.moved or "",
        **{
            f"view_displacement_m/{sensor}": f"{distance:.3f}"
            for sensor, distance in calibration.displacement.items()
        },
        "common_view_s": f"{calibration.collection.calibrator.memory.observed_s:.1f}",
        **_residuals(calibration.extrinsics),
        **{
            f"clock_ahead_ms/{sensor}": f"{offset.estimate_s * 1e3:.1f}"
            f" ± {offset.stddev_s * 1e3:.1f}"
            for sensor, offset in calibration.collection.clock_offsets.items()
        },
        "imus": ", ".join(calibration.imu_memory.segments) or "none",
        **_imus_reported(calibration),
        **calibration.counts,
        **counters.as_dict(),
    }


def _imus_reported(calibration: LiveCalibration) -> dict[str, object]:
    """Estimated offset of the IMUs' clock, also if it is taken as zero."""
    imus = calibration.collection.imus
    if imus is None:
        return {}
    if not np.isfinite(imus.offset_stddev_s):
        return {"clock_ahead_ms/imus": "unknown"}
    ahead_ms, stddev_ms = imus.offset_s * 1e3, imus.offset_stddev_s * 1e3
    return {"clock_ahead_ms/imus": f"{ahead_ms:.1f} ± {stddev_ms:.1f}"}


def _residuals(extrinsics: Extrinsics | None) -> dict[str, object]:
    """Residuals and uncertainties of the extrinsics."""
    if extrinsics is None:
        return {}
    values: dict[str, object] = {}
    for sensor, pair in extrinsics.residuals.items():
        values[f"median_residual_m/{sensor}"] = f"{pair.median:.4f}"
        values[f"raw_median_m/{sensor}"] = f"{pair.raw_median:.4f}"
        values[f"inlier_share/{sensor}"] = f"{pair.all_inlier_share:.2f}"
        values[f"scale/{sensor}"] = f"{pair.scale:.3f}"
        values[f"rotation_stddev_deg/{sensor}"] = f"{np.degrees(pair.rotation_stddev):.2f}"
        values[f"position_stddev_m/{sensor}"] = f"{pair.position_stddev:.4f}"
    if extrinsics.floor is not None:
        floor = extrinsics.floor
        values["vertical_from"] = floor.source
        values["vertical_stddev_deg"] = f"{np.degrees(floor.up_stddev):.1f}"
        values["sensor_height_m"] = f"{floor.height:.2f}"
        values["sensor_height_stddev_m"] = f"{floor.height_stddev:.2f}"
    for source, clock in extrinsics.clocks.items():
        values[f"clock_offset_ms/{source}"] = f"{clock.offset_ns * 1e-6:.1f}"
        values[f"clock_offset_stddev_ms/{source}"] = f"{clock.stddev_s * 1e3:.1f}"
        values[f"clock_drift_ppm/{source}"] = f"{clock.drift * 1e6:.0f}"
    return values
