"""Orientation filters by name: one file and one line in :data:`FILTERS` each."""

from imu_bridge.filters.device import DeviceOrientation
from imu_bridge.filters.madgwick import MadgwickOrientation
from imu_bridge.filters.orientation_filter import OrientationFilter
from imu_bridge.filters.vqf import VqfOrientation
from imu_bridge.filters.xio import XioOrientation

FILTERS: dict[str, type[OrientationFilter]] = {
    "vqf": VqfOrientation,
    "madgwick": MadgwickOrientation,
    "imufusion": XioOrientation,
    "device": DeviceOrientation,
}
"""Classes by the name in the parameter ``filter``; arguments: number of sensors, settings."""
