"""One person's pose from skeletons and IMUs, without ROS."""
