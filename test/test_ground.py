"""The table under an object is found where photos agree on its texture; nothing is in it."""

from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.photos.camera_file import CameraFile, Entry, sized
from active_recon.photos.conventions import looks_right
from active_recon.photos.cube import Cube, upward
from active_recon.photos.ground import BOARD_GROUND, Ground
from active_recon.photos.ground_search import found_ground
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_views
from active_recon.photos.saving import described
from active_recon.photos.views import even_choice, view_of
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import cell_centers, iou
import numpy as np
from photo_scene import thing
import photo_table
import pytest
import trimesh

pytestmark = pytest.mark.usefixtures('loaded_once')
UP = np.array([0.0, 0.0, 1.0])
SIZE = 0.14


def photos_of(mesh, cameras, pattern='boards', seed=0):
    images, _ = photo_table.photographed(mesh, cameras, pattern, np.random.default_rng(seed))
    return [view_of(str(number), *both)
            for number, both in enumerate(zip(images, cameras, strict=True))]


@pytest.fixture(scope='module')
def mesh():
    return photo_table.centred(thing(), SIZE)


@pytest.fixture(scope='module')
def cameras():
    return photo_table.around(5, 3 * SIZE, np.random.default_rng(1))


@pytest.fixture(scope='module')
def views(mesh, cameras):
    return photos_of(mesh, cameras)


def test_cells_are_above_the_ground_that_reach_above_it():
    below = BOARD_GROUND.above(Cube(np.zeros(3), 1.0, UP), 4)
    np.testing.assert_array_equal(below[0, 0], [False, False, True, True])
    cube = Cube(np.array([0.3, -0.2, 0.1]), 0.8, np.array([0.2, 0.1, 1.0]))
    tilted = Ground(np.array([0.6, 0.0, 0.8]), 0.15)
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T / 16
    reach = (cell_centers(16)[:, None] + corners) @ cube.rotation * cube.side + cube.centre
    np.testing.assert_array_equal(tilted.above(cube, 16).ravel(),
                                  (tilted.height(reach) > 0).any(axis=1))


@pytest.mark.parametrize('normal', [UP, np.array([0.0, 0.6, 0.8])])
def test_a_cube_on_the_ground_touches_it_with_its_lowest_corner(normal):
    ground = Ground(normal, -0.4)
    cube = ground.under(Cube(np.array([1.0, 2, 3]), 0.5, np.array([0.1, 0.0, 2])))
    corners = np.array(np.meshgrid(*[[-0.25, 0.25]] * 3)).reshape(3, -1).T
    heights = ground.height(corners @ cube.rotation + cube.centre)
    assert heights.min() == pytest.approx(0, abs=1e-9) and cube.side == 0.5
    moved = cube.centre - [1, 2, 3]
    np.testing.assert_allclose(np.cross(moved, normal), 0, atol=1e-9)


@pytest.fixture(scope='module')
def table(views):
    return found_ground(views, np.zeros(3), UP)


def test_a_table_is_found_as_high_as_it_is_and_level(views, mesh, table):
    aside = found_ground(views, np.array([0.02, -0.01, 0.03]), np.array([0.04, -0.03, 1.0]))
    under = np.array([0, 0, mesh.bounds[0, 2]])
    for ground in (table, aside):
        assert np.degrees(np.arccos(ground.normal @ UP)) < 0.5
        assert abs(ground.height(under)) < 0.01 * SIZE


def test_any_similarity_of_the_world_carries_the_table_along(views, table):
    turn = trimesh.transformations.rotation_matrix(2.0, [1, 2, -1])
    moved = []
    for view in views:
        pose = turn @ view.camera.pose
        pose[:3, 3] = 7 * pose[:3, 3] + [5, -3, 2]
        moved.append(view_of(view.name, view.image, Camera(pose, view.camera.intrinsics)))
    there = found_ground(moved, np.array([5.0, -3, 2]), turn[:3, :3] @ UP)
    np.testing.assert_allclose(there.normal, turn[:3, :3] @ table.normal, atol=0.01)
    assert float(there.height(np.array([5.0, -3, 2]))) == pytest.approx(
        7 * float(table.height(np.zeros(3))), abs=0.01 * 7 * SIZE)


def test_a_lid_with_a_texture_is_not_taken_for_the_table_below_it(cameras):
    box = trimesh.creation.box([SIZE, SIZE, 0.6 * SIZE]).subdivide().subdivide().subdivide()
    rng = np.random.default_rng(0)
    box.visual.vertex_colors = rng.integers(0, 256, (len(box.vertices), 3))
    ground = found_ground(photos_of(box, cameras), np.zeros(3), UP)
    assert float(ground.height(np.zeros(3))) == pytest.approx(0.3 * SIZE, abs=0.01 * SIZE)


def test_a_camera_at_the_object_s_place_does_no_harm(views, table):
    lost = view_of('lost', views[0].image, Camera(np.eye(4), views[0].camera.intrinsics))
    ground = found_ground([*views, lost], np.zeros(3), UP)
    assert ground.level == pytest.approx(table.level, abs=0.01 * SIZE)
    assert looks_right([view.camera for view in (*views, *views, lost)], np.zeros(3))


@pytest.mark.parametrize('count', [0, 2])
def test_two_photos_tell_no_table(views, count):
    assert found_ground(views[:count], np.zeros(3), UP) is None


@pytest.mark.slow
def test_a_texture_as_coarse_as_the_object_tells_no_table(mesh, cameras):
    assert found_ground(photos_of(mesh, cameras, 'coarse'), np.zeros(3), UP) is None


def test_without_a_table_there_is_none(views):
    rng = np.random.default_rng(0)
    for images in (np.full((5, 480, 640, 3), 200), rng.integers(0, 256, (5, 480, 640, 3))):
        others = [view_of(view.name, image.astype(np.uint8), view.camera)
                  for view, image in zip(views, images, strict=True)]
        assert found_ground(others, np.zeros(3), UP) is None


@pytest.mark.slow
def test_what_is_seen_from_below_stands_on_nothing(views, monkeypatch):
    low = view_of('low', views[0].image, Camera(
        np.diag([1.0, -1, -1, 1]) @ views[0].camera.pose, views[0].camera.intrinsics))
    assert low.camera.position[2] < 0
    with_low = [*views[:4], low]
    assert found_ground(with_low, np.zeros(3), UP) is None
    monkeypatch.setattr('active_recon.photos.ground_search.SEARCHED_VIEWS', 4)
    assert even_choice(with_low, 4)[-1] is not low  # which is not compared
    assert found_ground(with_low, np.zeros(3), UP) is None


@pytest.fixture(scope='module')
def shapes(views):
    """Return the shape on the table that is found, and that with none."""
    return [from_views(views, CameraFile('a table', ()), Options(ground=ground))
            for ground in (True, False)]


def test_an_object_on_a_table_with_a_pattern_is_found(shapes):
    shape, _ = shapes
    assert shape.background == 'the segmenter'
    assert 0.9 * SIZE < shape.size < 1.4 * SIZE
    np.testing.assert_allclose(shape.cube.centre, 0, atol=0.02)


def test_nothing_of_the_object_is_in_the_table_that_was_found(shapes, mesh):
    shape, without = shapes
    assert without.ground is None and described(without)['ground'] is None
    assert described(shape)['ground']['level'] == shape.ground.level
    carried = trimesh.transform_points(shape.mesh().vertices, shape.world_from_object)
    assert shape.ground.height(carried).min() > -0.03 * SIZE
    carried = trimesh.transform_points(without.mesh().vertices, without.world_from_object)
    assert shape.ground.height(carried).min() < -0.05 * SIZE
    ious = []
    for each in shapes:
        placed = mesh.copy()
        placed.apply_transform(np.linalg.inv(each.world_from_object))
        placed.apply_scale(1 / each.size)
        ious.append(iou(each.occupancy > each.threshold,
                        voxelise(placed, len(each.occupancy)).occupied(0.5)))
    assert ious[0] > ious[1]


def test_a_size_that_is_told_widens_the_cube_about_the_object_though_it_stands_on_a_table(
        views, shapes, monkeypatch):
    found, _ = shapes
    for name, result in (('found_ground', found.ground), ('found_cube', found.cube),
                         ('segmented_views', (views[:2], []))):
        monkeypatch.setattr(f'active_recon.photos.reconstruct.{name}',
                            lambda *given, result=result: result)
    told = from_views(views[:2], CameraFile('a table', (), metric=True), Options(size=2 * SIZE))
    assert told.ground is not None and told.cube.side == 2 * SIZE
    np.testing.assert_array_equal(told.cube.centre, found.cube.centre)


def test_where_nothing_is_above_what_was_taken_for_a_table_the_error_names_the_way_out(
        views, monkeypatch):
    monkeypatch.setattr('active_recon.photos.reconstruct.found_ground',
                        lambda views, middle, up: Ground(UP, 2 * SIZE))
    box = 0.0, 0.0, 0.0, 1.1 * SIZE
    for options in (Options(), Options(box=box), Options(box=box, background='network')):
        with pytest.raises(DataError, match='leave it out by --no-ground'):
            from_views(views[:3], CameraFile('a table', ()), options)


def test_the_object_is_upright_on_its_table_where_the_cameras_do_not_tell_what_is_up(shapes):
    shape, without = shapes
    np.testing.assert_allclose(shape.cube.up, shape.ground.normal)
    assert np.arccos(shape.cube.up @ UP) < np.arccos(without.cube.up @ UP)


def test_without_a_table_all_cameras_of_the_file_tell_what_is_up(views):
    poses = [view.camera.pose for view in views]
    file = CameraFile('a file', [Entry(str(number), pose, sized(photo_table.LENS))
                                 for number, pose in enumerate(poses)])
    shape = from_views(views[:1], file, Options(box=(0, 0, 0, SIZE), background='network'))
    np.testing.assert_allclose(shape.cube.up, upward(poses))
