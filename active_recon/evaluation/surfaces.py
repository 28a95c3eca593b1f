"""
How near a reconstructed surface is to the true one: what IoU does not tell of thin parts.

Distances count in sides of the object's cube. Surfaces are compared by points drawn evenly over
their area, the same points each time.
"""

from dataclasses import dataclass
import math
from typing import Any

from active_recon.volumes.voxels import VoxelGrid
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_opening
from scipy.spatial import cKDTree
import trimesh

SAMPLES = 50_000
"""Points of a surface: two drawings of one surface have an F-score of 0.99 at 1 % and more."""
ASKED = 10_000
"""How many of them look for the nearest of the other's: means change by less than 0.01."""
NEAR = (0.01, 0.02)
"""Distances, in sides of the cube, within which a point counts as found."""
_THICK = np.ones((3, 3, 3), np.bool_)


@dataclass(frozen=True)
class SurfaceScores:
    """
    A surface against the true one.

    - f_score_1, f_score_2: harmonic mean of the shares of either's points that are within 1 % and
      2 % of the cube's side of the other, [0, 1]
    - chamfer: mean of the two mean distances to the nearest point of the other, sides of the cube
    - normal_consistency: mean |cosine| between the normals there, both ways, [0, 1]

    Where there is no surface they are 0, 0, the cube's diagonal, and 0.
    """

    f_score_1: float
    f_score_2: float
    chamfer: float
    normal_consistency: float


NO_SURFACE = SurfaceScores(0.0, 0.0, math.sqrt(3), 0.0)


class SampledSurface:
    """
    Points (N, 3) drawn evenly from a mesh's surface, its normals there, and a tree over them.

    Which points they are depends on the mesh and the seed alone.
    """

    def __init__(self, mesh: trimesh.Trimesh, count: int = SAMPLES, seed: int = 0) -> None:
        points, faces = trimesh.sample.sample_surface(mesh, count, seed=seed)[:2]
        self.points = np.asarray(points, np.float64)
        self.normals = np.asarray(mesh.face_normals, np.float64)[faces]
        self.tree = cKDTree(self.points)


def compare_surfaces(found: SampledSurface, truth: SampledSurface) -> SurfaceScores:
    """Return the scores of a surface against the true one."""
    away, precise = _nearest(found, truth)
    missed, complete = _nearest(truth, found)
    alike = (precise + complete) / 2
    first, second = (_f_score(away, missed, near) for near in NEAR)
    return SurfaceScores(first, second, float((away.mean() + missed.mean()) / 2), alike)


def _nearest(asking: SampledSurface, asked: SampledSurface) -> tuple[NDArray[np.float64], float]:
    """Return distances to a surface's nearest points, and the mean |cosine| of the normals."""
    some = slice(ASKED)  # points are drawn one by one: any of them are a drawing
    away, nearest = asked.tree.query(asking.points[some])
    cosines = (asking.normals[some] * asked.normals[nearest]).sum(axis=1)
    return away, float(np.abs(cosines).mean())


def voxel_surface(occupancy: NDArray[Any], threshold: float, count: int = SAMPLES,
                  seed: int = 0) -> SampledSurface | None:
    """
    Return the surface of occupancies (X, Y, Z) at a threshold, in a cube of side 1.

    None where no cell is above it.
    """
    grid = VoxelGrid(np.asarray(occupancy, np.float32))
    if not grid.occupied(threshold).any():
        return None
    mesh = grid.mesh(threshold)
    return SampledSurface(mesh, count, seed) if mesh.area > 0 else None


def surface_scores(found: SampledSurface | None, truth: SampledSurface) -> SurfaceScores:
    """Return the scores of a surface that may not be there."""
    return NO_SURFACE if found is None else compare_surfaces(found, truth)


def thin_cells(truth: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """
    Return the cells of a shape (X, Y, Z) that one opening by 3 x 3 x 3 cells removes.

    Those are its parts of less than three cells across: legs, handles, sheets; edges stay.
    """
    return np.asarray(truth & ~binary_opening(truth, _THICK))


def recall(found: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> float:
    """Return the share of the cells wanted that were found; NaN where none is."""
    return float(found[wanted].mean()) if wanted.any() else math.nan


def _f_score(away: NDArray[np.float64], missed: NDArray[np.float64], near: float) -> float:
    precision, completeness = float((away < near).mean()), float((missed < near).mean())
    total = precision + completeness
    return 2 * precision * completeness / total if total else 0.0
