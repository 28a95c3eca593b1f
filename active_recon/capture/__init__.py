"""Images of a camera without a driver: a video device, a video file, or a folder of images."""
