"""Recorded runs as one HTML page that opens with no network; it knows no ROS."""
