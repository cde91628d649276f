"""Skeletons of one Kinect, from a recording: joint maps, formats, clocks, replay.

The way of a frame: ``formats`` read a file into a :class:`~pose_io.recordings.recording.Recording`;
``timeline`` gives each frame its stamp on the host's clock (``clocks`` maps the sensor's own
clock onto it); ``replay`` says which frame is due when; the node publishes it.
"""
