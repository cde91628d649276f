"""Sources of skeletons: one module and one line in ``SOURCES`` each."""

from importlib import import_module
from typing import TYPE_CHECKING

from kinect_bridge.sources.source import SkeletonSource

if TYPE_CHECKING:
    from kinect_bridge.parameters import KinectBridgeParameters

SOURCES = {
    "file": "recording.RecordingSource",
    "markers": "markers.MarkersSource",
    "zed": "zed.ZedSource",
    "hiros": "hiros.HirosSource",
    "named_poses": "named_poses.NamedPosesSource",
    "tf": "tf.TfSource",
    "udp": "udp.UdpSource",
    "nite2": "nite2.Nite2Source",
}
"""Module and class of each source; only the selected one is imported."""


def make_source(parameters: "KinectBridgeParameters") -> SkeletonSource:
    """Create the source selected by the parameters.

    Raises:
        PoseError: If one of its parameters is invalid.
    """
    module, name = SOURCES[parameters.source].split(".")
    return getattr(import_module(f"{__name__}.{module}"), name)(parameters)
