"""The page in the browser, by viser; without ROS."""
