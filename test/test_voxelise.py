"""Surfaces to solids: the surface's cells and what they enclose, whatever the triangles."""

import math

from active_recon.volumes.voxelisation import _filled, voxelise
from active_recon.volumes.voxels import iou
import numpy as np
import pytest
from scipy.ndimage import binary_fill_holes
import trimesh


def test_a_ball_is_solid_and_little_larger_than_itself():
    occupied = voxelise(trimesh.creation.icosphere(3, 0.4)).occupied(0.5)
    centers = (np.indices(occupied.shape) + 0.5) / 32 - 0.5
    away = np.linalg.norm(centers, axis=0)
    assert occupied[away < 0.4 - 1 / 32].all()
    assert not occupied[away > 0.4 + math.sqrt(3) / 2 / 32].any()


@pytest.mark.parametrize('seed', range(6))
def test_a_turned_box_has_no_hole_that_a_flood_gets_through(seed):
    box = trimesh.creation.box((0.5, 0.4, 0.45),
                               transform=trimesh.transformations.random_rotation_matrix(
                                   np.random.default_rng(seed).random(3)))
    centers = (np.indices((32, 32, 32)).reshape(3, -1).T + 0.5) / 32 - 0.5
    truth = box.contains(centers).reshape(32, 32, 32)
    occupied = voxelise(box).occupied(0.5)
    assert not (truth & ~occupied).any()


def test_a_cell_on_an_axis_stands_where_the_mesh_is():
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.apply_translation([0.3, -0.2, 0.1])
    points = voxelise(box).points(0.5)[:, :3]
    np.testing.assert_allclose(points.mean(axis=0), [0.3, -0.2, 0.1], atol=1 / 32)


def test_the_winding_and_the_order_of_the_faces_do_not_matter():
    mesh = trimesh.creation.torus(0.3, 0.1)
    other = trimesh.Trimesh(mesh.vertices, mesh.faces[::-1, ::-1], process=False)
    np.testing.assert_array_equal(voxelise(mesh).occupancy, voxelise(other).occupancy)


def test_an_open_surface_is_not_filled():
    ball = trimesh.creation.icosphere(3, 0.4)
    bowl = ball.submesh([ball.triangles_center[:, 2] < 0], append=True)
    occupied = voxelise(bowl).occupied(0.5)
    assert not occupied[16, 16, 16]
    assert occupied[16, 16, int((0.5 - 0.39) * 32)]


def test_finer_triangles_give_the_same_solid():
    mesh = trimesh.creation.icosphere(1, 0.45)
    assert iou(voxelise(mesh).occupied(0.5), voxelise(mesh.subdivide()).occupied(0.5)) > 0.99


@pytest.mark.parametrize('resolution', [16, 64])
def test_the_resolution_is_the_caller_s(resolution):
    occupied = voxelise(trimesh.creation.box((1, 1, 1)), resolution).occupied(0.5)
    assert occupied.shape == (resolution,) * 3
    assert occupied.all()


def test_long_thin_bars_take_the_cells_along_them_and_no_others():
    bars = [trimesh.creation.box((1, 0.002, 0.002)) for _ in range(100)]
    for bar, z in zip(bars, np.linspace(-0.4, 0.4, 100), strict=True):
        bar.apply_translation([0, 0, z])
    occupied = voxelise(trimesh.util.concatenate(bars)).occupied(0.5)
    assert occupied[:, 15:17, 4:28].any(axis=1).all()
    assert not occupied[:, :15].any()


@pytest.mark.parametrize('share', [0.0, 0.3, 0.6, 0.9, 1.0])
def test_what_is_enclosed_is_what_scipy_fills(share):
    surface = np.random.default_rng(0).random((16, 16, 16)) < share
    np.testing.assert_array_equal(_filled(surface), binary_fill_holes(surface))
