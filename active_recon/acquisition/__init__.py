"""Selection of the images that become views, and detection of faults in a camera's stream."""
