"""A cube that is too wide for its object, and the cube that would fit."""

from types import SimpleNamespace

import active_recon
from active_recon.cli.replay import _print_quality
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.objects import find_object
from active_recon.volumes.better_cube import better_cube, box_text, FEWEST_VIEWS, FILLED
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest

SIDE, CELLS = 0.4, 40  # cells of a centimetre


def grid(*spans):
    """Return a grid with a block between two cells along each axis."""
    occupancy = np.zeros((CELLS,) * 3, np.float32)
    occupancy[tuple(slice(*span) for span in spans)] = 0.9
    return VoxelGrid(occupancy, SIDE)


def test_the_cube_that_fits_is_about_what_was_found():
    found = better_cube(grid((10, 30), (18, 24), (0, 12)), 0.4, FEWEST_VIEWS)
    assert found.share == 0.5 and found.side == pytest.approx(0.2)
    assert found.centre == pytest.approx((0.0, 0.01, -0.14))
    assert found.warning == ('the object fills 50% of the side of its cube, which costs accuracy: '
                             'object_size 0.2 fits it, with the origin of the object frame moved '
                             'to (0, 0.01, -0.14) m')


@pytest.mark.parametrize('centre', [(1234.56789, -0.1, 0.0), (0.2, -1e-17, 5e5)])
def test_a_box_is_told_to_a_thousandth_of_its_side_wherever_it_is(centre):
    told = [float(value) for value in box_text(centre, 0.123456).split(',')]
    np.testing.assert_allclose(told, [*centre, 0.123456], rtol=0, atol=0.0001)
    assert '-0,' not in box_text(centre, 0.123456)


def test_who_has_the_object_in_the_middle_is_not_told_to_move_it():
    found = better_cube(grid((10, 30), (10, 30), (10, 30)), 0.4, FEWEST_VIEWS)
    assert found.warning.endswith('object_size 0.2 fits it')


def test_one_long_side_fills_a_cube():
    filled = round(FILLED * CELLS)
    assert better_cube(grid((18, 20), (18, 20), (0, filled)), 0.4, FEWEST_VIEWS) is None
    assert better_cube(grid((18, 20), (18, 20), (0, filled - 1)), 0.4, FEWEST_VIEWS) is not None


def test_an_object_off_the_middle_of_its_cube_is_told_where_that_would_be():
    found = better_cube(grid((0, 40), (4, 36), (0, 20)), 0.4, FEWEST_VIEWS)
    assert found.warning == ('the object is not in the middle of its cube, which costs accuracy: '
                             'object_size 0.4 fits it, with the origin of the object frame moved '
                             'to (0, 0, -0.1) m')
    assert better_cube(grid((0, 40), (4, 36), (9, 25)), 0.4, FEWEST_VIEWS) is None


def test_what_hovers_beside_the_object_is_no_part_of_what_fits_it():
    small = grid((10, 20), (10, 20), (0, 10))
    small.occupancy[38, 20, 20] = 0.9
    found = better_cube(small, 0.4, FEWEST_VIEWS)
    assert found.side == pytest.approx(0.1) and found.centre[2] == pytest.approx(-0.15)


def test_what_hovers_at_the_end_of_a_cube_hides_no_small_object():
    small = grid((10, 20), (10, 20), (0, 10))
    small.occupancy[0, 0, 39] = small.occupancy[39, 39, 39] = 0.9  # as wide as the cube
    found = better_cube(small, 0.4, FEWEST_VIEWS)
    assert found.side == pytest.approx(0.1) and found.centre[2] == pytest.approx(-0.15)


def test_parts_of_an_object_that_lie_apart_fill_the_cube_together():
    # A table whose legs were not found below its top
    table = grid((0, 40), (0, 40), (36, 40))
    table.occupancy[15:25, 15:25, 0:8] = 0.9
    assert better_cube(table, 0.4, FEWEST_VIEWS) is None


def test_cells_strewn_over_a_cube_fill_it():
    strewn = grid((0, 0), (0, 0), (0, 0))
    strewn.occupancy[::2, ::2, ::2] = 0.9
    assert better_cube(strewn, 0.4, FEWEST_VIEWS) is None


def test_too_few_views_and_an_empty_cube_tell_nothing():
    small = grid((10, 20), (10, 20), (10, 20))
    assert better_cube(small, 0.4, FEWEST_VIEWS - 1) is None
    assert better_cube(small, 0.95, FEWEST_VIEWS) is None


def test_a_replay_tells_of_it_after_the_last_view(capsys):
    known = SimpleNamespace(quality=None, grid=grid((10, 30), (10, 30), (10, 30)))
    steps = [SimpleNamespace(reconstruction=known)] * FEWEST_VIEWS
    _print_quality(SimpleNamespace(steps=steps), 0.4)
    assert capsys.readouterr().out.rstrip().endswith(
        'object_size 0.2 fits it; to replay the bag in that cube: --box 0,0,0,0.2')
    _print_quality(SimpleNamespace(steps=steps[1:]), 0.4)
    assert not capsys.readouterr().out


@pytest.fixture(scope='module')
def photographed():
    """Return images of a chair a metre high that stands on the origin, and cameras."""
    mesh = load_mesh(find_object('chair'))
    lens = Intrinsics(420, 420, 320, 240, 640, 480)
    cameras = [orbit_camera(azimuth, elevation, 2.8, lens)
               for azimuth, elevation in ((0.3, 0.2), (1.9, 0.6), (3.5, 0.3), (5.2, 0.7))]
    renderer = Renderer(mesh)
    images = [composite(renderer.render(camera), 255) for camera in cameras]
    raised = [camera.pose + np.eye(4)[:, [2]] * 0.5 * np.eye(4)[3] for camera in cameras]
    return images, [Camera(pose, lens) for pose in raised]


def test_the_advice_leads_to_a_cube_that_fits(photographed):
    images, cameras = photographed
    wide = active_recon.load(object_size=1.8, threads=1)
    for image, camera in zip(images, cameras, strict=True):
        known = wide.add_view(image, camera)
    found = better_cube(known.grid, wide.threshold, wide.view_count)
    assert found.side == pytest.approx(1.0, abs=0.1)
    assert found.centre == pytest.approx((0.0, 0.0, 0.5), abs=0.08)
    fitting = active_recon.load(object_size=found.side, threads=1)
    for image, camera in zip(images, cameras, strict=True):
        pose = camera.pose.copy()
        pose[:3, 3] -= found.centre
        known = fitting.add_view(image, Camera(pose, camera.intrinsics))
    assert better_cube(known.grid, fitting.threshold, fitting.view_count) is None


@pytest.mark.slow
def test_photos_in_a_wide_cube_are_told_the_box_that_fits(photographed):
    images, cameras = photographed
    told = active_recon.reconstruct(images, cameras, 1.8).warnings
    line, = (line for line in told if 'costs accuracy' in line)
    box = [float(value) for value in line.split('(--box) ')[1].split(' ')[0].split(',')]
    assert box == pytest.approx([0, 0, 0.5, 1.0], abs=0.1)
    fitting = active_recon.reconstruct(images, cameras, 1.8, box=box).warnings
    assert not any('costs accuracy' in line for line in fitting)
