"""Skeletons of one sensor, live or from a recording: joint maps, sources, formats, clocks.

The way of a live frame: a source of ``sources`` hears it and maps its joints (``joint_maps``);
``sources.live_clock`` gives it its stamp on the host's clock; the node publishes it.

The way of a recorded one: ``formats`` read a file into a
:class:`~kinect_bridge.recording.Recording`; ``timeline`` gives each frame its stamp (``clocks``
maps the sensor's own clock onto the host's); ``replay`` says which frame is due when.
"""
