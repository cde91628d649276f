"""Sources of skeletons: one module each, named in :data:`kinect_bridge.source.SOURCES`."""
