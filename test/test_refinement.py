"""A grid in narrower cells: where its surface goes, and what of the grid it keeps."""

from active_recon.errors import DataError
from active_recon.volumes.bodies import whole_bodies
from active_recon.volumes.refinement import refined, refined_mesh
from active_recon.volumes.voxels import iou, VoxelGrid
import numpy as np
import pytest
from scipy.ndimage import binary_dilation, gaussian_filter, label
from scipy.special import expit

RANDOM = VoxelGrid(np.random.default_rng(0).random((6, 6, 6), np.float32))


def ball(radius, side, center=(0.013, -0.021, 0.008)):
    """Return the probability that a cell touches a ball: one half where it just does not."""
    along = (np.arange(side) + 0.5) / side - 0.5
    cells = np.stack(np.meshgrid(along, along, along, indexing='ij'), axis=-1)
    beside = np.maximum(np.abs(cells - center) - 0.5 / side, 0)  # of a cell's nearest point
    depth = radius - np.linalg.norm(beside, axis=-1)
    return VoxelGrid(expit(depth * 4 * side).astype(np.float32))


def outside(mesh, radius, center=(0.013, -0.021, 0.008)):
    """Return how far a mesh's vertices are outside a ball."""
    return np.linalg.norm(mesh.vertices - center, axis=1) - radius


@pytest.mark.parametrize('radius', [0.23, 0.31, 0.4])
def test_the_surface_of_a_ball_is_nearer_the_ball_than_that_of_its_own_cells(radius):
    cells = ball(radius, 32)
    own, narrow = outside(cells.mesh(0.5), radius), outside(refined_mesh(cells, 0.5), radius)
    assert np.abs(narrow).mean() < 0.6 * np.abs(own).mean()
    assert 0 < narrow.mean() < 0.6 * own.mean()


@pytest.mark.parametrize('radius', [0.23, 0.31, 0.4])
def test_its_cells_are_those_that_a_ball_touches(radius):
    truth, cells = ball(radius, 64).occupied(0.5), ball(radius, 32)
    repeated = cells.occupancy.repeat(2, 0).repeat(2, 1).repeat(2, 2) > 0.5
    assert iou(refined(cells).occupied(0.5), truth) > 0.97 > iou(repeated, truth)


def test_it_has_twice_the_cells_a_side_in_the_same_cube():
    found = refined(VoxelGrid(RANDOM.occupancy, 0.3))
    assert (found.occupancy.shape, found.occupancy.dtype, found.size) == (
        (12, 12, 12), np.float32, 0.3)


def test_no_part_of_a_cell_is_more_probable_than_the_cell():
    parts = refined(RANDOM).occupancy.reshape(6, 2, 6, 2, 6, 2).max(axis=(1, 3, 5))
    assert (parts <= RANDOM.occupancy + 1e-6).all()


def test_where_all_cells_are_alike_so_are_their_parts():
    np.testing.assert_allclose(
        refined(VoxelGrid(np.full((4, 4, 4), 0.3, np.float32))).occupancy, 0.3, rtol=1e-5)


def test_along_a_slope_a_part_has_its_lowest_logit():
    slope = np.arange(8.0, dtype=np.float32)[:, None, None] - 4
    grid = VoxelGrid(np.broadcast_to(expit(slope), (8, 8, 8)).copy())
    logits = np.arange(16) / 2 - 4.5  # the narrow cell's lower end, in cells from the first centre
    inside = slice(1, -1)  # beyond the outer centres there is no slope
    np.testing.assert_allclose(refined(grid).occupancy[inside, 5, 5], expit(logits)[inside],
                               rtol=1e-5)


@pytest.mark.parametrize('axis', [0, 1, 2])
def test_it_turns_and_mirrors_with_the_grid(axis):
    expected = np.flip(refined(RANDOM).occupancy, axis)
    flipped = VoxelGrid(np.flip(RANDOM.occupancy, axis).copy())
    np.testing.assert_allclose(refined(flipped).occupancy, expected, atol=1e-6)
    turned = VoxelGrid(np.rot90(RANDOM.occupancy, 1, (axis, (axis + 1) % 3)).copy())
    np.testing.assert_allclose(
        refined(turned).occupancy,
        np.rot90(refined(RANDOM).occupancy, 1, (axis, (axis + 1) % 3)), atol=1e-6)


def test_cells_that_are_certain_give_probabilities():
    cells = RANDOM.occupied(0.5).astype(np.float32)
    found = refined(VoxelGrid(cells)).occupancy
    assert np.isfinite(found).all() and 0 <= found.min() <= found.max() <= 1


def test_its_mesh_is_closed_where_the_object_touches_the_border():
    mesh = refined_mesh(VoxelGrid(np.ones((8, 8, 8), np.float32), 2.0), 0.5)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.bounds, [[-1] * 3, [1] * 3], atol=1e-5)


def test_an_empty_grid_has_no_surface_either():
    with pytest.raises(DataError, match='no cell is above the threshold 0.5'):
        refined_mesh(VoxelGrid(np.full((4, 4, 4), 0.5, np.float32)), 0.5)


def test_what_is_too_thin_for_narrow_cells_keeps_its_own():
    needle = np.full((8, 8, 8), 0.05, np.float32)
    needle[3, 4] = 0.6
    grid = VoxelGrid(needle)
    assert not refined(grid).occupied(0.5).any()
    narrow = whole_bodies(grid, refined(grid), 0.5)
    np.testing.assert_array_equal(narrow.occupied(0.5), grid.occupied(0.5).repeat(2, 0).repeat(
        2, 1).repeat(2, 2))


def test_a_thin_part_stays_on_the_thick_one_that_it_hangs_on():
    cells = np.zeros((16, 16, 16), np.float32)
    cells[2:8, 5:11, 5:11] = 1
    cells[8:14, 8, 8] = 1  # a handle of one cell
    grid = VoxelGrid(cells)
    mesh = refined_mesh(grid, 0.5)
    assert mesh.body_count == 1
    assert mesh.bounds[1, 0] > 13.5 / 16 - 0.5
    thick = np.where(np.arange(16)[:, None, None] < 6, refined(grid).occupied(0.5)[::2, ::2, ::2],
                     False)
    whole = whole_bodies(grid, refined(grid), 0.5).occupied(0.5)[::2, ::2, ::2]
    np.testing.assert_array_equal(whole[:6], thick[:6])  # away from the handle nothing changes


@pytest.mark.parametrize('seed', range(3))
def test_a_grid_has_no_more_bodies_in_narrow_cells_than_in_its_own(seed):
    cells = np.random.default_rng(seed).random((12, 12, 12)).astype(np.float32) ** 2
    bodies = label(cells > 0.5, np.ones((3, 3, 3)))[1]
    mesh = refined_mesh(VoxelGrid(cells), 0.5)
    assert 1 <= mesh.body_count <= bodies
    assert mesh.is_watertight


@pytest.mark.parametrize('corner', [(8, 8, 0), (8, 0, 8), (8, 8, 8)])
def test_two_blocks_that_meet_at_an_edge_or_a_corner_are_both_there_and_one_body(corner):
    cells = np.zeros((24, 24, 24), np.float32)
    for first in np.array([4, 4, 4]), np.array([4, 4, 4]) + corner:
        x, y, z = (slice(start, start + 8) for start in first)
        cells[x, y, z] = 1
    mesh = refined_mesh(VoxelGrid(cells, 24.0), 0.5)
    assert mesh.body_count == 1
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.bounds[1], corner, atol=0.6)
    assert 0.85 * cells.sum() < mesh.volume < cells.sum()


@pytest.mark.parametrize('seed', range(3))
def test_no_cell_of_a_large_body_is_further_than_a_cell_from_what_is_kept(seed):
    cells = np.random.default_rng(seed).random((12, 12, 12)).astype(np.float32) ** 2
    grid, around = VoxelGrid(cells), np.ones((3, 3, 3))
    bodies, _ = label(grid.occupied(0.5), around)
    large = bodies == np.bincount(bodies[bodies > 0]).argmax()
    narrow = whole_bodies(grid, refined(grid), 0.5).occupied(0.5)
    kept = narrow.reshape(12, 2, 12, 2, 12, 2).any(axis=(1, 3, 5))
    assert not (large & ~binary_dilation(kept, around)).any()


def test_a_speck_beside_the_object_is_left_out_and_a_smaller_object_stays():
    cells = np.zeros((32, 32, 32), np.float32)
    cells[4:20, 4:20, 4:20] = 1
    cells[28, 28, 28] = 1
    assert refined_mesh(VoxelGrid(cells), 0.5).body_count == 1
    cells[26:30, 26:30, 26:30] = 1
    assert refined_mesh(VoxelGrid(cells), 0.5).body_count == 2


@pytest.mark.parametrize('threshold', [0.1, 0.55])
def test_a_threshold_of_numpy_cuts_as_a_plain_one(threshold):
    noise = np.random.default_rng(0).random((32,) * 3)
    smooth = gaussian_filter(noise, 1.5)
    grid = VoxelGrid(((smooth - smooth.min()) / np.ptp(smooth)).astype(np.float32))
    plain, numpy = (refined_mesh(grid, kind(threshold)) for kind in (float, np.float64))
    assert len(plain.faces) == len(numpy.faces)
    np.testing.assert_array_equal(plain.vertices, numpy.vertices)
