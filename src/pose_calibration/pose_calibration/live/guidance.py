"""Instructions to the person during the calibration of the extrinsics."""

from collections.abc import Sequence

import numpy as np

from pose_calibration.extrinsics.frame_memory import KeptFrame
from pose_calibration.extrinsics.joint_refinement import body_axes
from pose_calibration.live.parameters import LiveCalibrationParameters
from pose_core.api import Extrinsics, FloatArray, transformed
from pose_core.finite_numbers import are_known, nan_mean
from pose_core.joints import JOINT_INDEX

WANTED_WAY_M = 0.6  # [m] wanted range of the person's positions, sideways and in depth
WANTED_TURN = np.radians(60.0)  # [rad] wanted range of the body's headings
ALONE_S = 20.0  # [s] for which a single camera sees the person, for its vertical


def what_is_missing(
    extrinsics: Extrinsics,
    frames: Sequence[KeptFrame],
    observed_s: float,
    parameters: LiveCalibrationParameters,
) -> tuple[str, float]:
    """The most useful next movement, and the progress.

    Args:
        extrinsics: The calibration so far.
        frames: Stored frames.
        observed_s: Time of common view [s].
        parameters: All sensors, in the order of the frames' positions, and the uncertainty that
            suffices.

    Returns:
        A sentence, empty if nothing is missing; and the progress, 0 to 1.
    """
    sensors = parameters.sensors
    absent = [name for name in sensors if name not in extrinsics.sensors]
    if absent:
        share = len(extrinsics.sensors) / len(sensors)
        return (f"walk where '{absent[0]}' and another sensor both see you", 0.5 * share)
    if len(sensors) == 1 and observed_s < ALONE_S and extrinsics.floor is not None:
        known = f"the vertical is known to {np.degrees(extrinsics.floor.up_stddev):.1f} deg"
        return f"{known}: stand and walk upright", observed_s / ALONE_S
    shares = {
        name: min(
            parameters.enough_rotation_stddev / pair.rotation_noise,
            parameters.enough_position_stddev / pair.position_noise,
        )
        for name, pair in extrinsics.residuals.items()
    }
    worst = min(shares, key=lambda name: shares[name], default="")
    if not worst or shares[worst] >= 1.0:
        return "", 1.0
    pair = extrinsics.residuals[worst]
    known = (
        f"'{worst}' is known to {np.degrees(pair.rotation_stddev):.2f} deg and "
        f"{pair.position_stddev * 100.0:.1f} cm"
    )
    return f"{known}: {_advice(extrinsics, frames, sensors)}", shares[worst]


def _advice(extrinsics: Extrinsics, frames: Sequence[KeptFrame], sensors: Sequence[str]) -> str:
    """Instruction to cover the position or heading with the smallest range so far."""
    seen = np.stack([frame.positions for frame in frames], axis=1)  # (sensors, frames, 15, 3)
    poses = [extrinsics.T_map_sensor(name) for name in sensors]
    joints = nan_mean(np.stack([transformed(T, own) for T, own in zip(poses, seen, strict=True)]))
    neck = joints[:, JOINT_INDEX["neck"]]
    neck = neck[are_known(neck)]
    if len(neck) == 0:
        return "let the sensors see the whole person"
    depth, across = (_way(neck[:, axis]) for axis in (0, 1))
    axes = body_axes(joints)
    turn = _way(np.unwrap(np.arctan2(axes[:, 1, 0], axes[:, 0, 0])))  # [rad] range of headings
    shares = {
        f"walk nearer and farther ({depth:.1f} of {WANTED_WAY_M:.1f} m)": depth / WANTED_WAY_M,
        f"walk from side to side ({across:.1f} of {WANTED_WAY_M:.1f} m)": across / WANTED_WAY_M,
        f"turn to both sides ({np.degrees(turn):.0f} of {np.degrees(WANTED_TURN):.0f} deg)": turn
        / WANTED_TURN,
    }
    least = min(shares, key=lambda text: shares[text])
    return least if shares[least] < 1.0 else "continue to walk and to move the arms"


def _way(values: FloatArray) -> float:
    return float(np.subtract(*np.percentile(values, [95, 5])))
