"""The source that the parameters select."""

from importlib import import_module

from kinect_bridge.parameters import KinectBridgeParameters
from kinect_bridge.sources import SOURCES
from kinect_bridge.sources.source import SkeletonSource


def make_source(parameters: KinectBridgeParameters) -> SkeletonSource:
    """Create the source selected by the parameters.

    Raises:
        PoseError: If one of its parameters is invalid.
    """
    module, name = SOURCES[parameters.source].split(".")
    return getattr(import_module(f"kinect_bridge.sources.{module}"), name)(parameters)
