"""Frames of the sensors, transformed to map."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pose_core.arrays import FloatArray
from pose_core.joints import JOINTS
from pose_core.kernels.camera_geometry import transform_to_map
from pose_core.kernels.compiling import type_specialised
from pose_core.session.extrinsics import Extrinsics
from pose_core.streams.time_alignment import AlignedFrame


class SensorsInMap:
    """The sensors' poses in map, and their frames transformed by them.

    Args:
        sensors: Names of the sensors, in order.
        extrinsics: Poses of the sensors; None: not known yet.
    """

    def __init__(self, sensors: Sequence[str], extrinsics: Extrinsics | None) -> None:
        self._index = {sensor: index for index, sensor in enumerate(sensors)}
        self._T_map_sensor = np.full((len(sensors), 4, 4), np.nan)
        if extrinsics is not None:
            for sensor in extrinsics.T_reference_sensor.keys() & self._index.keys():
                self._T_map_sensor[self._index[sensor]] = extrinsics.T_map_sensor(sensor)
        self._into_map = type_specialised(transform_to_map)
        self.places: FloatArray = np.ascontiguousarray(self._T_map_sensor[:, :3, 3])
        """Positions of the sensors in map, (sensors, 3) [m]; NaN if unknown."""

    def transform(self, frame: AlignedFrame) -> tuple[FloatArray, NDArray[np.uint8]]:
        """Transform a frame, of some sensors or of none, to map.

        Returns:
            Positions of all joints, (sensors, 15, 3) [m], NaN where not observed; and their states,
            (sensors, 15).
        """
        count = len(self._index)
        positions = np.empty((count, len(JOINTS), 3))
        positions.fill(np.nan)
        state = np.zeros((count, len(JOINTS)), np.uint8)
        for sensor, sample in frame.samples.items():
            index = self._index[sensor]
            self._into_map(
                self._T_map_sensor[index],
                np.ascontiguousarray(sample.positions),
                np.ascontiguousarray(sample.tracking_state),
                positions[index],
                state[index],
            )
        return positions, state
