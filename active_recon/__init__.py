"""Active 3D reconstruction of an object from few camera views."""

__version__ = '0.1.0'
