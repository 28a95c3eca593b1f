"""A stored or rendered image, cropped to the object's cube as networks for any camera see it."""

from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framed_layers, framing_camera
import numpy as np
from numpy.typing import NDArray


def cropped(rgba: NDArray[np.uint8], camera: Camera, side: float,
            size: int) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """
    Return an image (H, W, 4) cropped to S x S pixels, and which of these the image has.

    The result, (S, S, 4), is premultiplied by alpha; the mask is (S, S). `side` is that of the
    grid, in the camera's unit.
    """
    layers = np.asarray(weighted(rgba).round(), np.uint8)
    return framed_layers(layers, camera, side, size)[:2]


def cropped_camera(camera: Camera, side: float, size: int) -> Camera:
    """Return the camera of what `cropped` returns, with lengths in sides of the grid."""
    return framing_camera(camera, side, size).scaled(1 / side)


def weighted(rgba: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return an RGBA image (H, W, 4), premultiplied by alpha, values in [0, 255]."""
    layers = rgba.astype(np.float32)
    layers[..., :3] *= layers[..., 3:] / 255
    return layers
