"""Sources of skeletons: one module and one line in ``SOURCES`` each."""

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
