"""Body-worn IMUs on serial ports: protocols, clocks, orientation filters, ROS node."""
