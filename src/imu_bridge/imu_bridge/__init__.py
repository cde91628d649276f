"""Body-worn IMUs on one serial port: wire protocol, clocks, Madgwick's filter, ROS node."""
