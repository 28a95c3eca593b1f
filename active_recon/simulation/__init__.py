"""A turntable with a camera, its faults, and the objects that it shows."""
