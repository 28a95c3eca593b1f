"""
Distance of a reconstructed surface from the true one; unlike IoU, it measures thin parts well.

Distances are in sides of the object's cube. Surfaces are compared by points drawn uniformly over
their area, with a fixed seed.
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
"""Points drawn on a surface: two drawings of the same have an F-score of 0.99 or more at 1 %."""
ASKED = 10_000
"""Number of them for which the nearest point is searched: changes means by less than 0.01."""
NEAR = (0.01, 0.02)
"""Distances, in sides of the cube, within which a point counts as matched."""
_THICK = np.ones((3, 3, 3), np.bool_)


@dataclass(frozen=True)
class SurfaceScores:
    """
    Comparison of a surface with the true one.

    - f_score_1, f_score_2: harmonic mean of precision and recall at a distance of 1 % and 2 % of
      the cube's side, [0, 1] (Tatarchenko et al. 2019)
    - chamfer: mean of the two mean distances to the nearest point of the other, sides of the cube
    - normal_consistency: mean |cosine| between the normals of nearest points, both ways, [0, 1]
      (Mescheder et al. 2019)

    Without a surface they are 0, 0, the cube's diagonal, and 0.
    """

    f_score_1: float
    f_score_2: float
    chamfer: float
    normal_consistency: float


NO_SURFACE = SurfaceScores(0.0, 0.0, math.sqrt(3), 0.0)


class SampledSurface:
    """
    Points (N, 3) drawn uniformly from a mesh's surface, their normals (N, 3), and a k-d tree.

    The points depend only on the mesh and the seed.
    """

    def __init__(self, mesh: trimesh.Trimesh, count: int = SAMPLES, seed: int = 0) -> None:
        points, faces = trimesh.sample.sample_surface(mesh, count, seed=seed)[:2]
        self.points = np.asarray(points, np.float64)
        self.normals = np.asarray(mesh.face_normals, np.float64)[faces]
        self.tree = cKDTree(self.points)


def compare_surfaces(found: SampledSurface, truth: SampledSurface) -> SurfaceScores:
    """Return the scores of a surface compared with the true one."""
    away, precise = _nearest(found, truth)
    missed, complete = _nearest(truth, found)
    alike = (precise + complete) / 2
    first, second = (_f_score(away, missed, near) for near in NEAR)
    return SurfaceScores(first, second, float((away.mean() + missed.mean()) / 2), alike)


def _nearest(asking: SampledSurface, asked: SampledSurface) -> tuple[NDArray[np.float64], float]:
    """Return the distances to the nearest points of `asked`, and the mean |cosine| of normals."""
    some = slice(ASKED)  # points are drawn independently, so the first ones are a sample too
    away, nearest = asked.tree.query(asking.points[some])
    cosines = (asking.normals[some] * asked.normals[nearest]).sum(axis=1)
    return away, float(np.abs(cosines).mean())


def voxel_surface(occupancy: NDArray[Any], threshold: float, count: int = SAMPLES,
                  seed: int = 0) -> SampledSurface | None:
    """
    Return the surface of occupancies (X, Y, Z) at a threshold, in a cube of side 1.

    None where no cell is above the threshold.
    """
    grid = VoxelGrid(np.asarray(occupancy, np.float32))
    if not grid.occupied(threshold).any():
        return None
    mesh = grid.mesh(threshold)
    return SampledSurface(mesh, count, seed) if mesh.area > 0 else None


def surface_scores(found: SampledSurface | None, truth: SampledSurface) -> SurfaceScores:
    """Return the scores of a surface, NO_SURFACE for None."""
    return NO_SURFACE if found is None else compare_surfaces(found, truth)


def thin_cells(truth: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """
    Return the cells of a shape (X, Y, Z) that a morphological opening by 3 x 3 x 3 cells removes.

    These are parts of less than three cells across: legs, handles, sheets; edges stay.
    """
    return np.asarray(truth & ~binary_opening(truth, _THICK))


def recall(found: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> float:
    """Return the fraction of the cells `wanted` that are in `found`; NaN where none is wanted."""
    return float(found[wanted].mean()) if wanted.any() else math.nan


def _f_score(away: NDArray[np.float64], missed: NDArray[np.float64], near: float) -> float:
    precision, completeness = float((away < near).mean()), float((missed < near).mean())
    total = precision + completeness
    return 2 * precision * completeness / total if total else 0.0
