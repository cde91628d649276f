"""imufusion: the revised complementary filter of Madgwick's thesis, by x-io Technologies.

References:
    Madgwick (2014), PhD thesis, University of Bristol, chapter 7.
    x-io Technologies, Fusion, https://github.com/xioTechnologies/Fusion.
"""

import imufusion
import numpy as np

from imu_bridge.filters.conditioned import ConditionedFilter
from imu_bridge.filters.madgwick import initial_orientation
from imu_bridge.filters.orientation_filter import FilterSettings, SampleRound
from imu_bridge.filters.quaternions import multiply
from imu_bridge.protocols.reading import STANDARD_GRAVITY
from pose_core.arrays import FloatArray

# imufusion's "north, west, up" has x north: rotated by 90 deg from x east, y north.
R_ENU_NWU = np.array([[0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]])
R_NWU_ENU = R_ENU_NWU * [-1.0, -1.0, -1.0, 1.0]


class XioOrientation(ConditionedFilter):
    """An :class:`OrientationFilter` with one imufusion filter per sensor.

    imufusion's own rejection is off, since :class:`ConditionedFilter` rejects disturbances.
    """

    def __init__(self, count: int, settings: FilterSettings) -> None:
        super().__init__(count, settings)
        self._filters = [self._begin() for _ in range(count)]

    def _begin(self) -> imufusion.Ahrs:
        ahrs = imufusion.Ahrs()
        ahrs.set_settings(
            imufusion.AhrsSettings(convention=imufusion.CONVENTION_NWU, gain=self._settings.gain)
        )
        return ahrs

    def _start(self, ahrs: imufusion.Ahrs, acceleration: FloatArray, field: FloatArray) -> None:
        """Initialise from the first sample, to avoid seconds of convergence."""
        up = acceleration / np.linalg.norm(acceleration)
        strength = np.linalg.norm(field)
        has_north = np.array([bool(strength > 0.0)])
        north = np.nan_to_num(field / strength if has_north[0] else field)
        q = initial_orientation(up[None], north[None], has_north)
        ahrs.set_quaternion(multiply(R_NWU_ENU, q)[0, [3, 0, 1, 2]])
        ahrs.skip_startup()

    def reset(self, index: int) -> None:
        """See :class:`OrientationFilter`."""
        super().reset(index)
        self._filters[index] = self._begin()

    def _advance(self, samples: SampleRound, rate: FloatArray, field: FloatArray) -> FloatArray:
        index, acceleration = samples.index, samples.acceleration
        degrees, g = np.degrees(rate), acceleration / STANDARD_GRAVITY
        has_field = ~np.isnan(field[:, 0])
        usable = np.abs(g).max(axis=1, initial=0.0) > 0.0
        orientation = np.full((len(index), 4), np.nan)
        # The library filters one sensor at a time.
        for row, i in enumerate(index.tolist()):
            ahrs = self._filters[i]
            if np.isnan(self.orientation[i, 3]):
                if not usable[row]:
                    continue
                self._start(ahrs, acceleration[row], field[row])
            ahrs.set_sample_period(samples.dt[row])
            if has_field[row]:
                ahrs.update(degrees[row], g[row], field[row] * 1e6)
            else:
                ahrs.update_no_magnetometer(degrees[row], g[row])
            orientation[row] = ahrs.get_quaternion()
        return multiply(np.broadcast_to(R_ENU_NWU, orientation.shape), orientation[:, [1, 2, 3, 0]])
