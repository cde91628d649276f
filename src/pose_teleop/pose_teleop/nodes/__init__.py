"""The nodes: the only modules, with ``conversions``, that import ROS."""
