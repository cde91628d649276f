"""Skeletons of one sensor, live or from a recording, as ROS messages.

Live frames: a source of ``sources`` receives them and maps their joints; ``live_clock`` computes
their stamps on the host's clock; the node publishes them.

Recorded frames: ``pose_io.recordings`` reads a file and computes the stamps; ``replay`` schedules
the frames.
"""
