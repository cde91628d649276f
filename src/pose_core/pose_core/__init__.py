"""One person's pose from skeletons and IMUs, without ROS: see :mod:`pose_core.api`."""

__version__ = "0.1.0"
