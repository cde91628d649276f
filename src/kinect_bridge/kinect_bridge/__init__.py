"""Skeletons of one sensor, live or from a recording, as ROS messages.

The way of a live frame: a source of ``sources`` hears it and maps its joints; ``live_clock`` gives
it its stamp on the host's clock; the node publishes it.

The way of a recorded one: ``pose_io.recordings`` reads a file and gives each frame its stamp;
``replay`` says which frame is due when.
"""
