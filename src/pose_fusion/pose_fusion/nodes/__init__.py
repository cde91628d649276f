"""ROS nodes: with ``conversions``, the only modules of this package that import ROS."""
