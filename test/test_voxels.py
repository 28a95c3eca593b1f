"""The voxel grid: its measures, and what comes back from its forms on disk."""

import math

from active_recon.errors import DataError
from active_recon.volumes.binvox import read_binvox, write_binvox
from active_recon.volumes.point_grids import grid_from_points
from active_recon.volumes.voxels import (
    entropy,
    iou,
    paper_entropy,
    PUBLISHED_FLOOR,
    turned,
    VoxelGrid,
)
import numpy as np
import pytest
import torch
import trimesh

RNG = np.random.default_rng(0)
PROBABILITIES = RNG.random((8, 8, 8), np.float32)


def ball(radius: float, resolution: int = 32, size: float = 1.0) -> VoxelGrid:
    """Return the smooth occupancy of a ball: one half on its surface."""
    centers = (np.indices((resolution,) * 3) + 0.5) / resolution - 0.5
    away = (np.linalg.norm(centers, axis=0) - radius) * resolution
    return VoxelGrid(np.clip(0.5 - away / 4, 0, 1).astype(np.float32), size)


def test_certain_cells_have_no_entropy():
    occupancy = (PROBABILITIES > 0.5).astype(np.float64)
    assert VoxelGrid(occupancy.astype(np.float32)).entropy() == 0
    assert entropy(occupancy) == paper_entropy(occupancy) == 0


def test_cells_at_one_half_have_the_highest_entropy():
    grid = VoxelGrid(np.full((8, 8, 8), 0.5, np.float32))
    assert grid.entropy() == pytest.approx(512 * math.log(2))
    assert 0 < VoxelGrid(PROBABILITIES).entropy() < grid.entropy()


def test_entropy_is_the_same_of_a_shape_and_its_complement_but_the_paper_s_is_not():
    shape, complement = PROBABILITIES / 2, 1 - PROBABILITIES / 2
    assert entropy(shape) == pytest.approx(entropy(complement), rel=1e-5)
    both = paper_entropy(shape) + paper_entropy(complement)
    assert entropy(shape) == pytest.approx(both, rel=1e-5)
    assert paper_entropy(shape) != pytest.approx(paper_entropy(complement), rel=0.1)


@pytest.mark.parametrize('cells', [8, 32, 64])
def test_a_grid_and_its_cloud_have_the_same_entropy_to_the_bit(cells):
    grid = VoxelGrid(RNG.random((cells,) * 3, np.float32) ** 4, 0.3)
    assert not grid.occupied(PUBLISHED_FLOOR).all()
    cloud = grid_from_points(grid.points(PUBLISHED_FLOOR), 0.3)
    assert cloud.entropy() == grid.entropy() == grid.above(PUBLISHED_FLOOR).entropy()
    published = grid.above(PUBLISHED_FLOOR).occupancy.astype(np.float64)
    assert grid.entropy() == pytest.approx(entropy(published))
    assert grid.entropy() < entropy(grid.occupancy.astype(np.float64))


def test_cells_that_are_not_published_have_no_entropy():
    assert VoxelGrid(np.full((4, 4, 4), PUBLISHED_FLOOR, np.float32)).entropy() == 0


def test_iou_is_symmetric_and_bounded_and_one_only_of_the_same():
    a, b = RNG.random((2, 5, 8, 8, 8)) > 0.6
    assert iou(a, b).shape == (5,)
    np.testing.assert_array_equal(iou(a, b), iou(b, a))
    assert ((iou(a, b) > 0) & (iou(a, b) < 1)).all()
    assert (iou(a, a) == 1).all()
    assert (iou(a, ~a) == 0).all()


def test_iou_counts_what_is_shared_over_what_is_in_either():
    a, b = np.zeros((2, 4, 4, 4), bool)
    a[0], b[:2] = True, True
    assert iou(a, b) == 0.5


def test_two_empty_shapes_are_alike_and_an_empty_one_is_unlike_any_other():
    empty, full = np.zeros((4, 4, 4), bool), np.ones((4, 4, 4), bool)
    assert iou(empty, empty) == 1
    assert iou(empty, full) == 0


@pytest.mark.parametrize('axes', [(-3, -2, -1), (-2, -1)])
def test_iou_of_tensors_is_that_of_arrays(axes):
    a, b = RNG.random((2, 3, 6, 6, 6)) > 0.5
    of_tensors = iou(torch.from_numpy(a), torch.from_numpy(b), axes)
    np.testing.assert_allclose(of_tensors.numpy(), iou(a, b, axes), rtol=1e-6)


@pytest.mark.parametrize('size', [0.3, 1.0, 2.0])
@pytest.mark.parametrize('resolution', [1, 7, 24, 32, 48, 64, 100])
def test_points_come_back_as_the_grid_that_they_were(size, resolution):
    occupancy = RNG.random((resolution,) * 3, np.float32)
    occupancy[0, 0, 0] = 1
    points = VoxelGrid(occupancy, size).points(0.4)
    assert (np.abs(points[:, :3]) < size / 2).all()
    back = grid_from_points(points, size)
    np.testing.assert_array_equal(back.occupancy, np.where(occupancy > 0.4, occupancy, 0))


@pytest.mark.parametrize('size', [0.35, 1.0])
@pytest.mark.parametrize('resolution', [
    2, 4, 8, 16, 32, 64, 128, pytest.param(256, marks=pytest.mark.slow)])
def test_one_point_tells_a_grid_whose_side_is_a_power_of_two(size, resolution):
    for cell in RNG.integers(0, resolution, (20, 3)):
        center = (cell + 0.5) / resolution * size - size / 2
        grid = grid_from_points(np.float32([[*center, 0.75]]), size)
        assert grid.occupancy.shape == (resolution,) * 3
        np.testing.assert_array_equal(np.argwhere(grid.occupancy), [cell])


def test_points_that_a_coarser_grid_has_too_do_not_hide_those_that_it_has_not():
    occupancy = np.zeros((96,) * 3, np.float32)
    occupancy[1::3, 1::3, 1::3] = 0.5  # the centres of 32 cells a side
    points = VoxelGrid(occupancy).points(0)
    assert len(grid_from_points(points).occupancy) == 32
    occupancy[95, 95, 95] = 0.5  # the last of all
    np.testing.assert_array_equal(grid_from_points(VoxelGrid(occupancy).points(0)).occupancy,
                                  occupancy)


def test_no_points_are_an_empty_grid_of_the_resolution_that_is_asked_for():
    none = np.empty((0, 4), np.float32)
    assert grid_from_points(none).occupancy.shape == (32, 32, 32)
    grid = grid_from_points(none, 0.5, 64)
    assert (grid.size, grid.occupancy.shape, grid.occupancy.any()) == (0.5, (64, 64, 64), False)


def test_an_empty_grid_becomes_as_fine_as_another_and_any_other_stays():
    full, empty = VoxelGrid(np.ones((64, 64, 64), np.float32)), grid_from_points(
        np.empty((0, 4), np.float32))
    assert empty.as_fine_as(full).occupancy.shape == (64, 64, 64)
    assert not empty.as_fine_as(full).occupancy.any()
    assert full.as_fine_as(empty) is full


HALF = 1 / 128  # of a cell, at 64 cells a side


@pytest.mark.parametrize(('points', 'said'), [
    ([[HALF, HALF, HALF, 0.5]] * 2, '2 in 1 cells of 64 a side'),
    ([[HALF, HALF, HALF, 0.5], [HALF * 1.1, HALF, HALF, 0.5]], 'at most 256 cells a side'),
    ([[HALF, HALF, HALF, 0.5], [0.3 / 7, 0.1, 0.2, 0.5]], 'at most 256 cells a side'),
    ([[HALF, HALF, HALF, math.nan]], r'in \[0, 1\], got nan'),
    ([[HALF, HALF, HALF, 1.5]], r'in \[0, 1\], got 1.5')],
    ids=['two in a cell', 'beside a centre', 'no grid', 'no occupancy', 'too much'])
def test_points_that_are_not_cells_of_one_grid_are_refused(points, said):
    with pytest.raises(DataError, match=said) as caught:
        grid_from_points(np.float32(points))
    assert caught.value.kind == 'cloud'


def test_a_point_is_the_centre_of_its_cell():
    occupancy = np.zeros((4, 4, 4), np.float32)
    occupancy[3, 0, 1] = 0.75
    np.testing.assert_allclose(VoxelGrid(occupancy, 2.0).points(0.5),
                               [[0.75, -0.75, -0.25, 0.75]])


@pytest.mark.parametrize('x', [0.6, -0.6, math.nan, math.inf])
def test_a_point_outside_the_cube_is_refused(x):
    with pytest.raises(DataError, match=r'point out of the cube: expected all inside a cube of '
                       r'1\.0 m'):
        grid_from_points(np.array([[x, 0, 0, 1]], np.float32))


@pytest.mark.parametrize('shape', [(4, 4), (4, 4, 5), (1, 4, 4, 4)])
def test_what_is_no_cube_is_refused(shape):
    with pytest.raises(DataError, match='not a cube: expected as many voxels'):
        VoxelGrid(np.zeros(shape, np.float32))


@pytest.mark.parametrize('size', [0.0, -1.0, math.nan, math.inf])
def test_a_cube_without_a_side_is_refused(size):
    with pytest.raises(DataError, match='invalid size: expected a finite side'):
        VoxelGrid(np.zeros((2, 2, 2), np.float32), size)


@pytest.mark.parametrize('size', [0.2, 1.0])
def test_the_mesh_of_a_ball_is_closed_outward_and_has_its_volume(size):
    mesh = ball(0.4, size=size).mesh(0.5)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * (0.4 * size) ** 3, rel=0.01)
    np.testing.assert_allclose(mesh.bounds, [[-0.4 * size] * 3, [0.4 * size] * 3],
                               atol=0.01 * size)


def test_a_mesh_is_closed_where_the_object_touches_the_border_and_stays_inside():
    mesh = VoxelGrid(np.ones((8, 8, 8), np.float32), 2.0).mesh(0.5)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.bounds, [[-1] * 3, [1] * 3], atol=1e-6)
    assert VoxelGrid(PROBABILITIES).mesh(0.5).is_watertight


def test_a_mesh_stands_where_its_cells_are():
    occupancy = np.zeros((16, 16, 16), np.float32)
    occupancy[12:15, 2:5, 8:10] = 1
    grid = VoxelGrid(occupancy, 0.4)
    mesh = grid.mesh(0.5)
    np.testing.assert_allclose(mesh.bounds.mean(axis=0), grid.points(0.5)[:, :3].mean(axis=0),
                               atol=1e-6)


def test_a_mesh_is_the_same_for_a_threshold_of_numpy_and_of_python():
    occupancy = np.zeros((8, 8, 8), np.float32)
    occupancy[2:6, 2:6, 2:6] = 0.4  # a little above 0.4 in float64
    occupancy[3, 3, 3] = 0.9
    one, other = (VoxelGrid(occupancy).mesh(threshold) for threshold in (0.4, np.float64(0.4)))
    np.testing.assert_array_equal(one.triangles, other.triangles)


def test_where_no_cell_is_above_the_threshold_there_is_no_mesh():
    with pytest.raises(DataError, match='no cell is above the threshold 0.5'):
        VoxelGrid(np.full((4, 4, 4), 0.5, np.float32)).mesh(0.5)


@pytest.mark.parametrize('occupancy', [
    RNG.random((32, 32, 32)) > 0.5, np.zeros((32, 32, 32)), np.ones((32, 32, 32)),
    ball(0.4).occupancy > 0.5, np.arange(512).reshape(8, 8, 8) < 255,
    np.arange(512).reshape(8, 8, 8) < 510], ids=['noise', 'empty', 'full', 'ball', '255', '510'])
def test_binvox_comes_back_as_it_was(occupancy, tmp_path):
    grid = VoxelGrid(occupancy.astype(np.float32), 0.37)
    write_binvox(grid, tmp_path / 'new' / 'model.binvox')
    back = read_binvox(tmp_path / 'new' / 'model.binvox')
    np.testing.assert_array_equal(back.occupancy, grid.occupancy)
    assert back.size == pytest.approx(grid.size)


def test_binvox_is_read_by_other_software_with_y_up(tmp_path):
    occupancy = np.zeros((8, 8, 8), np.float32)
    occupancy[6, 1, 2] = 1  # x, y, z of ours, whose z is up
    write_binvox(VoxelGrid(occupancy), tmp_path / 'model.binvox')
    read = trimesh.load(tmp_path / 'model.binvox')
    np.testing.assert_array_equal(np.argwhere(read.matrix), [[6, 2, 8 - 1 - 1]])


def test_other_programs_find_the_cube_of_a_binvox_about_the_origin(tmp_path):
    write_binvox(VoxelGrid(np.ones((8, 8, 8), np.float32), 0.4), tmp_path / 'model.binvox')
    read = trimesh.load(tmp_path / 'model.binvox')
    np.testing.assert_allclose(read.bounds.mean(axis=0), 0, atol=0.4 / 8)


def binvox(data: bytes, dim: str = '2 2 2', scale: str = '1') -> bytes:
    return f'#binvox 1\ndim {dim}\ntranslate 0 0 0\nscale {scale}\ndata\n'.encode() + data


@pytest.mark.parametrize('content', [
    b'', b'\x89PNG\r\n', b'dim 2 2 2\nscale 1\ndata\n\x00\x08', binvox(b''),
    binvox(b'\x01\x07'), binvox(b'\x01\x09'), binvox(b'\x01\x08\x00'), binvox(b'\x07\x08'),
    binvox(b'\x01\x08', dim='2 4'), binvox(b'\x01\x08', dim='2 2 x'),
    binvox(b'\x01\x08', dim='1 2 4'), binvox(b'\x01\x08', dim='-2 -2 2'),
    binvox(b'\x01\x08', scale='nan'), binvox(b'\x01\x08', scale='0'), binvox(b'', dim='0 0 0'),
    b'#binvox 1\ndata\n\x01\x08'])
def test_what_is_no_whole_binvox_is_refused_with_its_path(content, tmp_path):
    path = tmp_path / 'model.binvox'
    path.write_bytes(content)
    with pytest.raises(DataError, match='model.binvox: no whole binvox file'):
        read_binvox(path)


def test_a_written_binvox_cut_anywhere_is_refused(tmp_path):
    path = tmp_path / 'model.binvox'
    write_binvox(VoxelGrid((PROBABILITIES > 0.5).astype(np.float32)), path)
    whole = path.read_bytes()
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(DataError):
            read_binvox(path)


def test_a_missing_binvox_is_refused(tmp_path):
    with pytest.raises(DataError, match='No such file'):
        read_binvox(tmp_path / 'model.binvox')


def test_a_quarter_turn_is_counter_clockwise():
    np.testing.assert_allclose(turned(PROBABILITIES, math.pi / 2),
                               np.rot90(PROBABILITIES, axes=(0, 1)), atol=1e-6)
    assert turned(PROBABILITIES, 0) is PROBABILITIES


def test_a_ball_turned_is_the_same_ball():
    occupancy = ball(0.35).occupancy
    back = turned(occupancy, 0.7)
    assert iou(back > 0.5, occupancy > 0.5) > 0.97


def test_what_is_above_a_threshold_stays_and_the_rest_is_empty():
    grid = VoxelGrid(PROBABILITIES, 0.3)
    above = grid.above(0.6)
    assert above.size == grid.size
    assert np.array_equal(above.occupied(0), grid.occupied(0.6))
    assert np.array_equal(above.occupancy[above.occupied(0)], grid.occupancy[grid.occupied(0.6)])
