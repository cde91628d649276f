"""What the browser shows, in terms of viser; knows no ROS."""
