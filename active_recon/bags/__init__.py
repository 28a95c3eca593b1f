"""An episode as an MCAP bag: written here with no ROS installed, read by any rosbag2 reader."""
