"""Skeletons of one Kinect, from a recording, as messages.

The way of a frame: :mod:`pose_io.recordings` reads a file and gives each frame its stamp on the
host's clock; ``replay`` says which frame is due when; the node publishes it.
"""
