"""Palettes of things: four colours that go together, as plain, loud, dark or pale as in a shop."""

import colorsys

from active_recon.shapes.common import materials
import numpy as np
from numpy.typing import NDArray

Palette = NDArray[np.float64]

_MATERIALS = (materials.wood, materials.fabric, materials.metal, materials.paint,
              materials.plastic, materials.glass, materials.rubber)


def draw_palette(rng: np.random.Generator) -> Palette:
    """Return a main, a second and an accent colour and one for details, (4, 3) in [0, 255]."""
    schemes = (_mixed, _one_hue, _loud, _dark, _pale, _bare)
    return schemes[rng.choice(len(schemes), p=[0.27, 0.14, 0.28, 0.11, 0.12, 0.08])](rng)


def ripe(rng: np.random.Generator, hues: tuple[float, float]) -> NDArray[np.float64]:
    """Return a strong colour of a range of hues, (3,)."""
    return _hsv(rng.uniform(*hues), rng.uniform(0.45, 0.95), rng.uniform(0.45, 1))


def furry(rng: np.random.Generator) -> Palette:
    """Return a coat and its markings, (4, 3): mostly of animals, at times of plush."""
    if rng.random() < 0.25:
        return draw_palette(rng)
    main = _hsv(rng.uniform(0.03, 0.12), rng.uniform(0, 0.7), rng.uniform(0.1, 0.95))
    pale = np.clip(main * 0.4 + 150, 0, 255)
    dark = main * rng.uniform(0.25, 0.6)
    return np.array([main, pale if rng.random() < 0.6 else dark, dark, [25, 22, 20]])


def _hsv(hue: float, saturation: float, value: float) -> NDArray[np.float64]:
    return 255 * np.array(colorsys.hsv_to_rgb(hue % 1, saturation, value))


def _mixed(rng: np.random.Generator) -> Palette:
    """Return four materials of any sort."""
    return np.array([_MATERIALS[rng.choice(len(_MATERIALS))](rng) for _ in range(4)])


def _one_hue(rng: np.random.Generator) -> Palette:
    """Return shades of one hue."""
    hue, saturation = rng.uniform(), rng.uniform(0.1, 0.9)
    values = rng.permutation([0.25, 0.5, 0.75, 0.95]) + rng.uniform(-0.05, 0.05, 4)
    return np.array([_hsv(hue + rng.normal(0, 0.02), saturation, value) for value in values])


def _loud(rng: np.random.Generator) -> Palette:
    """Return saturated colours far apart, one of them at times black or white."""
    start, step = rng.uniform(), rng.choice([0.12, 0.33, 0.5])
    palette = np.array([_hsv(start + i * step, rng.uniform(0.65, 1), rng.uniform(0.5, 1))
                        for i in range(4)])
    if rng.random() < 0.5:
        palette[rng.integers(1, 4)] = rng.choice([20, 245])
    return palette


def _dark(rng: np.random.Generator) -> Palette:
    """Return blacks and anthracites with one accent."""
    palette = np.array([_hsv(rng.uniform(), rng.uniform(0, 0.25), rng.uniform(0.05, 0.3))
                        for _ in range(4)])
    palette[2] = _hsv(rng.uniform(), rng.uniform(0, 1), rng.uniform(0.4, 1))
    return palette


def _pale(rng: np.random.Generator) -> Palette:
    """Return whites, creams and pastels with one stronger accent."""
    palette = np.array([_hsv(rng.uniform(), rng.uniform(0, 0.25), rng.uniform(0.82, 1))
                        for _ in range(4)])
    palette[2] = _hsv(rng.uniform(), rng.uniform(0.4, 0.9), rng.uniform(0.3, 0.9))
    return palette


def _bare(rng: np.random.Generator) -> Palette:
    """Return one material all over, hardly varied."""
    color = _MATERIALS[rng.choice(len(_MATERIALS))](rng)
    return np.clip(color + rng.normal(0, 6, (4, 1)), 0, 255)
