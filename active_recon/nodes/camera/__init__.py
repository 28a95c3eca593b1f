"""Receives a camera: its images, poses and faults."""
