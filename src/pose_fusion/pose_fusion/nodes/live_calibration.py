"""The calibration node run until it is done, for ``./pose calibrate live``."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pose_calibration.geometry.rigid_transform import CalibrationError
from pose_calibration.live.live_calibration import LiveCalibration
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.api import Extrinsics
from pose_fusion.nodes.calibration import CalibrationNode
from pose_node.nodes.declaring import overrides_of
from pose_node.nodes.running import node_of_tool, spin_until


def calibrate_live(
    options: Mapping[str, Any], timeout_s: float, on_progress: Callable[[LiveCalibration], None]
) -> Extrinsics:
    """Calibrate from the running sensors.

    Args:
        options: Parameters of the calibration node by name; None: the default.
        timeout_s: Total time limit [s].
        on_progress: Called periodically with the progress.

    Raises:
        CalibrationError: If there is no result in time; the message says what was missing.
    """
    overrides = overrides_of(LiveCalibrationParameters, options)
    with node_of_tool(partial(CalibrationNode, parameter_overrides=overrides)) as (node, executor):
        spin_until(
            executor,
            lambda: node.calibration.is_finished,
            timeout_s,
            lambda: on_progress(node.calibration),
        )
        found, sensors = node.calibration.extrinsics, node.calibration.parameters.sensors
        if found is None or set(found.sensors) != set(sensors):
            missing = node.calibration.missing
            raise CalibrationError(f"not calibrated within {timeout_s:.0f} s: {missing}")
        return found
