"""ROS nodes; the only modules of this package, beside ``conversions``, that import ROS."""
