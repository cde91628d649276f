"""Where skeletons come from: one module a source, one line a source in ``SOURCES``."""

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
"""Module and class of each source; only the one that is used is loaded."""


def make_source(parameters: "KinectBridgeParameters") -> SkeletonSource:
    """The source that the parameters name.

    Raises:
        PoseError: If one of its parameters is not what it should be.
    """
    module, name = SOURCES[parameters.source].split(".")
    return getattr(import_module(f"{__name__}.{module}"), name)(parameters)
