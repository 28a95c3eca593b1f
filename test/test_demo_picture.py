"""The picture of a run: where things stand on it, and that it shows what it was given."""

from functools import cache
import math

from active_recon.demo.drawing import PAPER
from active_recon.demo.picture import COLUMNS, run_picture, TILE, turntable_plan, voxel_tile
from active_recon.geometry.cameras import orbit_camera
from active_recon.view_colors import view_color
from active_recon.viewer.view_result import ViewResult
from active_recon.volumes.boxes import height_range, voxel_boxes
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh

CONE = trimesh.creation.cone(radius=0.3, height=0.9).apply_translation([0, 0, -0.45])
TRUTH = voxelise(CONE)


@cache
def image_from(azimuth):
    return composite(Renderer(CONE).render(orbit_camera(azimuth)), 255)


def seen(azimuth=0.0, occupied=TRUTH):
    return ViewResult(0, orbit_camera(azimuth), image_from(azimuth), 100.0, 0.01, occupied, 1.0)


def center_of(picture, color):
    """Return the mean x and y of the pixels of just that colour."""
    y, x = np.nonzero((picture == color).all(axis=2))
    return x.mean(), y.mean()


@pytest.mark.parametrize(('azimuth_deg', 'right', 'down'), [
    (0, 0, 1), (90, 1, 0), (180, 0, -1), (270, -1, 0)])
def test_plan_puts_the_front_below_and_turns_counter_clockwise(azimuth_deg, right, down):
    plan = turntable_plan([seen(math.radians(azimuth_deg))], CONE)
    x, y = center_of(plan, view_color(1))
    middle = plan.shape[0] / 2
    direction = np.array([x - middle, y - middle]) / np.hypot(x - middle, y - middle)
    np.testing.assert_allclose(direction, [right, down], atol=0.05)


def test_views_that_came_back_to_a_place_are_all_seen():
    plan = turntable_plan([seen(), seen(), seen()], CONE)
    assert all((plan == view_color(number)).all(axis=2).sum() > 30 for number in (1, 2, 3))


@pytest.mark.parametrize(('views', 'rows'), [
    (1, 1), (COLUMNS - 1, 1), (COLUMNS, 2), pytest.param(24, 5, marks=pytest.mark.slow)])
def test_picture_has_room_for_every_view_and_the_truth(views, rows):
    picture = run_picture('a run', [seen(n / 4) for n in range(views)], CONE, TRUTH)
    assert picture.dtype == np.uint8
    assert rows * 2 * TILE < picture.shape[0] < (rows + 1) * 2 * TILE + 200


def test_picture_is_the_same_from_tiles_drawn_as_the_views_came_in():
    views = [seen(n / 4, VoxelGrid(TRUTH.occupancy * (n > 0))) for n in range(3)]
    draw = cache(voxel_tile)
    for view in views:
        draw(view.occupied, height_range(TRUTH))
    picture = run_picture('a run', views, CONE, TRUTH, draw)
    assert draw.cache_info().misses == len(views)
    np.testing.assert_array_equal(picture, run_picture('a run', views, CONE, TRUTH))


def test_empty_occupancy_and_an_image_not_heard_leave_their_tiles_empty():
    empty = VoxelGrid(np.zeros_like(TRUTH.occupancy))
    view = ViewResult(0, orbit_camera(0.0), None, 0.0, 0.01, empty, 0.0)
    picture = run_picture('a run', [view], CONE, TRUTH)
    tile = picture[-TILE - 60:-80, 600:600 + TILE - 60]
    assert (tile == PAPER).all()


def test_boxes_stand_where_their_cells_are():
    occupancy = np.zeros((32, 32, 32), np.float32)
    occupancy[31, 0, 16] = 1
    boxes = voxel_boxes(VoxelGrid(occupancy, size=4.0), (0, 31))
    np.testing.assert_allclose(boxes.centroid, [15.5 / 32, -15.5 / 32, 0.5 / 32])
    assert boxes.volume == pytest.approx((0.93 / 32) ** 3)


def test_faces_turned_away_from_the_viewpoint_are_never_seen():
    camera = orbit_camera(math.radians(30), elevation=math.radians(25))
    heights = height_range(TRUTH)
    every = voxel_boxes(TRUTH, heights)
    facing = voxel_boxes(TRUTH, heights, camera.position)
    assert len(facing.faces) == len(every.faces) // 2  # three of a box's six sides
    seen_all, seen_facing = (composite(Renderer(boxes).render(camera, 3), 255).astype(int)
                             for boxes in (every, facing))
    assert (seen_all != 255).any()
    assert (np.abs(seen_all - seen_facing).max(axis=2) > 2).mean() < 1e-3  # of ties at an edge


def test_heights_span_the_occupied_layers():
    occupancy = np.zeros((32, 32, 32), np.float32)
    assert height_range(VoxelGrid(occupancy)) == (0, 31)
    occupancy[3, 4, 5:9] = 1
    assert height_range(VoxelGrid(occupancy)) == (5, 8)
