"""Small draws that all kinds of things share: chances, smooth profiles, paths."""

from collections.abc import Callable
import math

from active_recon.shapes.common.soft_parts import smoothed
from active_recon.shapes.things.solids import circle
import numpy as np
from numpy.typing import NDArray
import trimesh

Generator = Callable[[np.random.Generator], trimesh.Trimesh]
Points = NDArray[np.float64]


def chance(rng: np.random.Generator, share: float) -> bool:
    """Return True in such a share of the draws."""
    return bool(rng.random() < share)


def section(rng: np.random.Generator, round_share: float = 0.7, points: int = 40) -> Points:
    """Return a section of unit size: a circle mostly, or a polygon, a rounded square, flutes."""
    if chance(rng, round_share):
        return circle(points)
    around = circle(72)
    kind = rng.integers(4)
    if kind == 0:
        return circle(int(rng.integers(3, 11)))
    if kind == 1:  # a rounded square or oblong
        power = rng.uniform(2.5, 7)
        square: Points = np.sign(around) * np.abs(around) ** (2 / power)
        return square * [1, rng.uniform(0.5, 1) if chance(rng, 0.5) else 1]
    if kind == 2:
        return around * [1, rng.uniform(0.55, 0.85)]
    angles = np.arctan2(around[:, 1], around[:, 0])
    lobes, depth = int(rng.integers(3, 13)), rng.uniform(0.03, 0.14)
    wave = np.cos(lobes * angles)
    wave = np.abs(wave) if chance(rng, 0.4) else wave
    fluted: Points = around * (1 - depth + depth * wave)[:, None]
    return fluted


def smooth_profile(corners: object, rounds: int = 2) -> Points:
    """Return a profile of (radius, z) with its corners rounded off."""
    return smoothed(np.asarray(corners, np.float64), rounds)


def random_profile(rng: np.random.Generator, height: float, low: float, high: float,
                   knots: int) -> Points:
    """Return a smooth random profile of (radius, z) from z = 0 up, radii between low and high."""
    levels = np.linspace(0, height, knots)
    levels[1:-1] += rng.uniform(-0.3, 0.3, knots - 2) * height / knots
    return smooth_profile(np.column_stack([rng.uniform(low, high, knots), levels]), 3)


def arc(start: float, end: float, radius: float = 1.0, points: int = 16) -> Points:
    """Return points of an arc about 0, angles in radians, (points, 2)."""
    angles = np.linspace(start, end, points)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def helix(radius: Points | float, turns: float, rise: float, points_a_turn: int = 20) -> Points:
    """Return a screw line about the z axis from z = 0 up to rise, (N, 3)."""
    share = np.linspace(0, 1, max(int(turns * points_a_turn), 3))
    radii = np.interp(share, np.linspace(0, 1, np.size(radius)), np.ravel(radius))
    angles = 2 * math.pi * turns * share
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), rise * share])


def globe(radius: float, points: int = 13) -> Points:
    """Return a ball's profile of (radius, z) about 0."""
    angles = np.linspace(-math.pi / 2, math.pi / 2, points)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])
