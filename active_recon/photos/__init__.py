"""A folder of photos with known cameras, reconstructed without a robot and without ROS."""
