"""A camera as a node receives it: images, poses, faults."""
