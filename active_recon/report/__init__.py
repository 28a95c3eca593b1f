"""Reports of recorded runs: one self-contained HTML page, made without ROS."""
