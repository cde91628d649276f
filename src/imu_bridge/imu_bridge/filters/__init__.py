"""Orientation filters by name: one file each, and a line in :data:`FILTERS`."""

from collections.abc import Callable

from imu_bridge.filters.device import DeviceOrientation
from imu_bridge.filters.madgwick import MadgwickOrientation
from imu_bridge.filters.orientation_filter import FilterSettings, OrientationFilter
from imu_bridge.filters.vqf import VqfOrientation
from imu_bridge.filters.xio import XioOrientation

FILTERS: dict[str, Callable[[int, FilterSettings], OrientationFilter]] = {
    "vqf": VqfOrientation,
    "madgwick": MadgwickOrientation,
    "imufusion": XioOrientation,
    "device": DeviceOrientation,
}
"""By the name that the parameter ``filter`` uses; each is made from the number of sensors."""
