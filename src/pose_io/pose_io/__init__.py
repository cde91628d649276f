"""Bags, recordings, references and exports, without ROS."""
