"""Colours of real materials, drawn at random: three numbers in [0, 255]."""

import colorsys

import numpy as np
from numpy.typing import NDArray

_Rgb = NDArray[np.float64]


def _hsv(rng: np.random.Generator, hue: tuple[float, float], saturation: tuple[float, float],
         value: tuple[float, float]) -> _Rgb:
    return 255 * np.array(colorsys.hsv_to_rgb(
        rng.uniform(*hue) % 1, rng.uniform(*saturation), rng.uniform(*value)))


def wood(rng: np.random.Generator) -> _Rgb:
    """Return a wood, from birch to walnut."""
    return _hsv(rng, (0.05, 0.11), (0.3, 0.7), (0.3, 0.9))


def fabric(rng: np.random.Generator) -> _Rgb:
    """Return an upholstery colour, often muted."""
    return _hsv(rng, (0, 1), (0.02, rng.uniform(0.15, 0.75)), (0.25, 0.95))


def metal(rng: np.random.Generator) -> _Rgb:
    """Return a bare or blackened metal."""
    return _hsv(rng, (0.55, 0.65), (0, 0.12), (0.15, 0.85))


def paint(rng: np.random.Generator) -> _Rgb:
    """Return a strong coat of paint, white and black among them."""
    if rng.random() < 0.35:
        return _hsv(rng, (0, 1), (0, 0.08), (0.12, 1))
    return _hsv(rng, (0, 1), (0.5, 0.95), (0.4, 1))


def plastic(rng: np.random.Generator) -> _Rgb:
    """Return a plastic: white, grey, black, or bright."""
    return paint(rng) if rng.random() < 0.5 else _hsv(rng, (0, 1), (0, 0.1), (0.15, 1))


def glass(rng: np.random.Generator) -> _Rgb:
    """Return dark or bluish glass, seen as opaque."""
    return _hsv(rng, (0.5, 0.62), (0.1, 0.4), (0.2, 0.75))


def rubber(rng: np.random.Generator) -> _Rgb:
    """Return a tyre's black."""
    return _hsv(rng, (0, 1), (0, 0.1), (0.08, 0.2))
