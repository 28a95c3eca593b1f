"""Surfaces of grids: closed, oriented, nowhere through themselves, whatever the grid."""

from active_recon.evaluation.self_intersections import self_intersections
from active_recon.volumes.isosurface import isosurface, without_voids
from active_recon.volumes.refinement import refined, refined_mesh
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh

RNG = np.random.default_rng(0)
SIDE = 10
FROM_CENTRE = np.linalg.norm((np.indices((SIDE,) * 3) + 0.5) / SIDE - 0.5, axis=0)
VOLUMES = {
    'noise': RNG.random((SIDE,) * 3),
    'sparse noise': RNG.random((SIDE,) * 3) ** 4,
    'yes or no': RNG.random((SIDE,) * 3) > 0.5,
    'values at the threshold': np.round(RNG.random((SIDE,) * 3) * 4) / 4,
    'checkerboard': np.indices((SIDE,) * 3).sum(axis=0) % 2,
    'cells that meet at corners': np.indices((SIDE,) * 3).min(axis=0) == np.indices(
        (SIDE,) * 3).max(axis=0),
    'full': np.ones((SIDE,) * 3),
    'one cell': np.eye(SIDE ** 3)[0].reshape((SIDE,) * 3),
    'hollow ball': (FROM_CENTRE < 0.45) & (FROM_CENTRE > 0.25),
    'two bodies': np.abs(np.indices((SIDE,) * 3)[0] - 4.5) > 2}


@pytest.fixture(params=VOLUMES, scope='module')
def volume(request):
    return np.asarray(VOLUMES[request.param], np.float32)


def grid_of(volume, make):
    return refined(VoxelGrid(volume)).occupancy if make == 'refined' else volume


@pytest.mark.parametrize('make', ['own', 'refined'])
def test_every_surface_is_closed_and_oriented_and_nowhere_through_itself(volume, make):
    occupancy = grid_of(volume, make)
    if not (occupancy > 0.5).any():  # nothing is left of what is so thin
        occupancy = volume
    mesh = isosurface(occupancy, 0.5, 0.2)
    _, counts = np.unique(np.sort(mesh.edges, axis=1), axis=0, return_counts=True)
    assert (counts == 2).all()
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert (mesh.area_faces > 0).all()
    assert not len(self_intersections(mesh))
    assert np.abs(mesh.bounds).max() <= 0.1 + 1e-9


def test_every_corner_has_one_fan_of_faces(volume):
    """Faces around a corner that are joined by edges are all of its faces."""
    mesh = isosurface(volume, 0.5)
    fans = trimesh.graph.connected_component_labels(
        _joined_at_corners(mesh), node_count=3 * len(mesh.faces))
    for_corner = np.unique(np.column_stack([mesh.faces.ravel(), fans]), axis=0)
    assert len(for_corner) == len(mesh.vertices)


def _joined_at_corners(mesh):
    """Return pairs of face corners, 3 * face + corner, of one vertex in faces with one edge."""
    where = {}
    for face, corners in enumerate(mesh.faces):
        for at, vertex in enumerate(corners):
            where[face, vertex] = 3 * face + at
    return np.array([[where[first, vertex], where[second, vertex]]
                     for (first, second), edge in zip(
                         mesh.face_adjacency, mesh.face_adjacency_edges, strict=True)
                     for vertex in edge])


def test_the_surface_is_within_a_thousandth_of_a_cell_of_where_the_grid_crosses():
    occupancy = np.clip(1 - 1.2 * FROM_CENTRE, 0, 1).astype(np.float32)
    mesh = isosurface(occupancy, 0.5)
    radius = np.linalg.norm(mesh.vertices, axis=1)
    assert np.abs(radius - 0.5 / 1.2).max() < 0.05 / SIDE + 1e-3


def test_voids_are_filled_and_what_is_open_stays_open():
    hollow = VOLUMES['hollow ball'].astype(np.float32)
    assert without_voids(hollow, 0.5)[SIDE // 2, SIDE // 2, SIDE // 2] == 1
    assert refined_mesh(VoxelGrid(hollow), 0.5).body_count == 1
    opened = hollow.copy()
    opened[SIDE // 2, SIDE // 2, :SIDE // 2] = 0
    np.testing.assert_array_equal(without_voids(opened, 0.5), opened)


def test_loose_bodies_stay():
    assert refined_mesh(VoxelGrid(VOLUMES['two bodies'].astype(np.float32)), 0.5).body_count == 2


def test_balls_that_overlap_run_through_each_other_and_balls_apart_do_not():
    def two(apart):
        balls = [trimesh.creation.icosphere(2, 0.3).apply_translation([x, x / 5, x / 7])
                 for x in (0, apart)]
        return self_intersections(trimesh.util.concatenate(balls))
    assert len(two(0.35)) > 20
    assert not len(two(0.7))
