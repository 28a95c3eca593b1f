"""Colours as images have them, sRGB, and as light, which is what glTF has at a mesh's corners."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def to_linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return sRGB colours (..., 3) as light, 255 for the brightest."""
    shares = colors / 255
    light = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.rint(255 * light), np.uint8)


def from_linear(light: NDArray[Any]) -> NDArray[np.uint8]:
    """Return light (..., 3), floats in [0, 1] or shares of an unsigned type, as sRGB colours."""
    most = np.iinfo(light.dtype).max if light.dtype.kind == 'u' else 1
    shares = np.clip(light / most, 0, 1)
    colors = np.where(shares <= 0.0031308, 12.92 * shares, 1.055 * shares ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * colors), np.uint8)
