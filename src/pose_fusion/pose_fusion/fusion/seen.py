"""What the sensors saw at one instant, in map."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pose_common.joints import JOINTS
from pose_fusion.calibration.extrinsics import Extrinsics
from pose_fusion.streams.samples import FloatArray
from pose_fusion.streams.time_alignment import AlignedFrame


@dataclass(frozen=True, kw_only=True)
class SeenFrame:
    """What the sensors saw at one instant, in map."""

    stamp_ns: int  # [ns]
    sensors: Collection[str]  # whose frames these are
    positions: FloatArray  # (sensors, 15, 3) [m]; NaN unseen
    tracking_state: NDArray[np.uint8]  # (sensors, 15)


def places_in_map(sensors: Sequence[str], extrinsics: Extrinsics | None) -> FloatArray:
    """Where the sensors stand, (sensors, 3) [m]; NaN those that the extrinsics do not place."""
    places = np.full((len(sensors), 3), np.nan)
    if extrinsics is not None:
        for index, sensor in enumerate(sensors):
            if sensor in extrinsics.T_reference_sensor:
                places[index] = extrinsics.T_map_sensor(sensor)[:3, 3]
    return places


def seen_in_map(
    frame: AlignedFrame, sensors: Sequence[str], extrinsics: Extrinsics | None
) -> SeenFrame:
    """Bring a frame into map.

    Args:
        frame: Of some sensors, or of none.
        sensors: All that there are, in their order.
        extrinsics: Where they are.
    """
    positions = np.full((len(sensors), len(JOINTS), 3), np.nan)
    state = np.zeros((len(sensors), len(JOINTS)), np.uint8)
    for index, sensor in enumerate(sensors):
        sample = frame.samples.get(sensor)
        if sample is None or extrinsics is None:
            continue
        T_map_sensor = extrinsics.T_map_sensor(sensor)
        positions[index] = sample.positions @ T_map_sensor[:3, :3].T + T_map_sensor[:3, 3]
        state[index] = np.where(np.isfinite(positions[index, :, 0]), sample.tracking_state, 0)
    return SeenFrame(
        stamp_ns=frame.stamp_ns,
        sensors=frame.samples.keys(),
        positions=positions,
        tracking_state=state,
    )
