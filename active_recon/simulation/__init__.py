"""A simulated turntable with a camera: its motion, its faults, and its objects."""
