"""The nodes; ROS begins here."""
