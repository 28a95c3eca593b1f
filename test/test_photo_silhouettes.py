"""Masks, hulls and conventions: what silhouettes say of an object, and when they contradict."""

from dataclasses import replace
import math
import sys

from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.photos import matting
from active_recon.photos.backgrounds import grabcut, named, off_plain, separated, shown_image
from active_recon.photos.conventions import conventions, looks_right, misreading
from active_recon.photos.cube import Cube, first_cube, meeting_point, upward
from active_recon.photos.doubts import _covered
from active_recon.photos.hull import (
    ceiling,
    coverage,
    depth_in_masks,
    hull,
    seen_cells,
)
from active_recon.photos.readers import LOOKS
from active_recon.photos.views import even_choice, PhotoView, view_of
from active_recon.volumes.object_box import object_box
from active_recon.volumes.voxelisation import voxelise
import numpy as np
from photo_scene import cameras, CENTRE, LENS, on_plain, rendered, SIDE, thing
import pytest

UP = np.array([0.0, 0.0, 1.0])
CUBE = Cube(CENTRE, 1.1 * SIDE, UP)


@pytest.fixture(scope='module')
def views():
    taken = cameras(6)
    return [view_of(f'photo{number}', image, camera)
            for number, (image, camera) in enumerate(zip(rendered(taken), taken, strict=True))]


def placed(views):
    return [CUBE.camera(view.camera, 1.0) for view in views]


@pytest.fixture(scope='module')
def true_cells():
    mesh = thing()
    mesh.apply_translation(-CENTRE)
    mesh.apply_scale(1 / CUBE.side)
    return voxelise(mesh, 48).occupied(0.5)


def test_the_hull_holds_the_object_and_shrinks_with_every_view(views, true_cells):
    before = np.ones_like(true_cells)
    for count in (1, 3, 6):
        cells = hull(depth_in_masks(views[:count], placed(views[:count]), 48))
        assert (cells & true_cells).sum() > 0.98 * true_cells.sum()
        assert not (cells & ~before).any() and cells.sum() < before.sum()
        before = cells


def test_depths_in_masks_are_in_cells_whatever_their_number(views):
    coarse, fine = (depth_in_masks(views[:2], placed(views[:2]), side) for side in (16, 48))
    np.testing.assert_allclose(3 * coarse, fine[1::3, 1::3, 1::3], atol=1e-4)


def test_the_ceiling_is_the_threshold_at_the_hull_s_surface(views):
    depths = np.array([[[-9.0, -0.51, -0.49, 9.0]]], np.float32)
    np.testing.assert_array_equal(ceiling(depths, 0.4) > 0.4, hull(depths))
    assert ceiling(depths, 0.4)[0, 0, 0] == 0 and ceiling(depths, 0.4)[0, 0, 3] == 1


def test_masks_that_are_right_are_covered_and_others_are_not(views):
    right = hull(depth_in_masks(views, placed(views), 48))
    assert coverage(right, views, placed(views)) > 0.99
    turned = [replace(view, mask=view.mask[::-1, ::-1]) for view in views]
    wrong = hull(depth_in_masks(turned, placed(views), 48))
    assert coverage(wrong, turned, placed(views)) < 0.97


def test_views_without_a_mask_say_nothing(views):
    blind = [replace(view, mask=None) for view in views]
    assert np.isinf(depth_in_masks(blind, placed(views), 8)).all()
    assert coverage(np.ones((8, 8, 8), bool), blind, placed(views)) == 1


def test_only_what_half_of_the_cameras_have_in_their_photos_counts_as_seen(views):
    assert seen_cells(placed(views), 8).all()
    aside = [Camera(camera.pose @ np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0],
                                            [0, 0, 0, 1.0]]), camera.intrinsics)
             for camera in placed(views)]
    assert not seen_cells(aside, 8).any()


def test_of_two_cameras_both_must_have_a_cell_in_their_photo_and_of_one_that_one(views):
    one = placed(views)[0]
    elsewhere = Camera(one.pose @ np.diag([1.0, -1, -1, 1]), one.intrinsics)
    assert seen_cells([one], 8).all() and seen_cells([one, one], 8).all()
    assert not seen_cells([one, elsewhere], 8).any()
    assert seen_cells([one, one, elsewhere], 8).all()


def test_the_box_of_the_largest_part_is_found():
    cells = np.zeros((10, 10, 10), bool)
    cells[2:5, 3:9, 4:6] = cells[9, 9, 9] = True
    np.testing.assert_allclose(object_box(cells), [[-0.3, -0.2, -0.1], [0, 0.4, 0.1]])
    assert object_box(np.zeros((4, 4, 4), bool)) is None


def test_a_cube_and_its_part_say_the_same_of_a_camera(views):
    part = CUBE.part(np.array([[-0.5, -0.25, 0], [0, 0.25, 0.5]]))
    assert part.side == pytest.approx(1.09 * 0.5 * CUBE.side)
    assert CUBE.part(np.array([[-0.5, -0.25, 0], [0, 0.25, 0.5]]), 1.0).side == 0.5 * CUBE.side
    np.testing.assert_allclose(part.centre, CENTRE + CUBE.side * np.array([-0.25, 0, 0.25]))


@pytest.mark.parametrize('up', [[0, 0, 1], [0, 1, 0], [-1, 0, 0], [0.3, -0.5, 0.2]])
def test_the_object_frame_has_z_up_and_is_undone_by_world_from_object(up, views):
    cube = Cube(CENTRE, 0.4, np.array(up, float))
    np.testing.assert_allclose(cube.rotation @ up, [0, 0, np.linalg.norm(up)], atol=1e-12)
    assert np.linalg.det(cube.rotation) == pytest.approx(1)
    camera = cube.camera(views[0].camera, 2.0)
    back = cube.world_from_object(2.0) @ camera.pose
    np.testing.assert_allclose(back[:3, 3], views[0].camera.position, atol=1e-12)
    np.testing.assert_allclose(back[:3, :3] / 0.2, views[0].camera.pose[:3, :3], atol=1e-12)


def test_optical_axes_meet_where_all_cameras_look(views):
    taken = [view.camera for view in views]
    np.testing.assert_allclose(meeting_point(taken), CENTRE, atol=1e-9)
    np.testing.assert_allclose(first_cube(taken, UP).centre, CENTRE, atol=1e-9)
    np.testing.assert_allclose(upward([camera.pose for camera in taken]), UP, atol=0.1)
    with pytest.raises(DataError, match='expected photos from several directions, got 1'):
        meeting_point(taken[:1])


def test_no_cube_is_refused():
    for centre, side in ((CENTRE, 0), (CENTRE * np.nan, 1)):
        with pytest.raises(ConfigError, match='box: no cube'):
            Cube(centre, side, UP)
    with pytest.raises(ConfigError, match='up: no direction'):
        Cube(CENTRE, 1, 0 * UP)


@pytest.mark.parametrize('looks', LOOKS)
def test_each_convention_but_the_right_one_is_a_misreading(views, looks):
    taken = [view.camera for view in views]
    assert looks_right(taken)
    assert not misreading(taken, None, looks) and not misreading(taken, CENTRE, looks)
    others = conventions([camera.pose for camera in taken], looks)
    for words, poses in list(others.items())[:-1]:
        wrong = [Camera(pose, taken[0].intrinsics) for pose in poses]
        assert not looks_right(wrong), words
        assert 'would fit' in misreading(wrong, None, looks)


def test_a_plain_background_is_told_from_the_object(views):
    image = on_plain(np.dstack([views[0].image, views[0].mask * np.uint8(255)]))
    found = off_plain(image)
    assert (found == views[0].mask).mean() > 0.99
    rng = np.random.default_rng(0)
    assert off_plain(rng.integers(0, 255, image.shape, np.uint8)) is None
    with pytest.raises(ViewError, match='no object: expected one before the plain background'):
        off_plain(np.full_like(image, 130))


def test_masks_of_a_camera_in_the_middle_of_the_cube_agree_with_none(views):
    lost = replace(views[0], camera=Camera(np.eye(4), views[0].camera.intrinsics))
    assert _covered([lost, *views], replace(CUBE, centre=np.zeros(3))) == 0


def test_grabcut_finds_the_object_in_its_projected_cube(views):
    image = on_plain(np.dstack([views[1].image, views[1].mask * np.uint8(255)]), (90, 120, 60))
    found = grabcut(image, placed(views)[1], 1.0)
    assert (found & views[1].mask).sum() > 0.9 * (found | views[1].mask).sum()
    near = orbit_camera(0.1, 0.3, 1.0, views[0].camera.intrinsics)
    assert grabcut(image, near, 1.0) is None  # nothing is certainly background
    inside = Camera(np.eye(4), views[0].camera.intrinsics)
    with pytest.raises(ViewError, match="camera in the object's cube"):
        grabcut(image, inside, 1.0)


def test_what_removed_the_background_is_named(views):
    view = view_of('plain', on_plain(np.dstack([views[0].image,
                                                views[0].mask * np.uint8(255)])),
                   views[0].camera)
    camera = placed(views)[0]
    for background, source, white in (('auto', 'network and plain', False),
                                      ('plain', 'plain', True), ('network', 'network', False),
                                      ('grabcut', 'grabcut', True),
                                      ('segment', 'segmenter', True)):
        image, found = shown_image(separated(view, background), camera, 1.0, background)
        assert found == source
        assert (image[0, 0] == 255).all() == white
    assert separated(views[0], 'auto').mask is views[0].mask
    assert separated(views[0], 'network').mask is None
    assert named(['masks', 'masks', 'network']) == (
        "masks from files (2), the network's own silhouettes (1)")


def test_views_at_even_steps_keep_their_order():
    assert even_choice(list(range(16)), 5) == [0, 3, 6, 9, 12]
    assert even_choice([1, 2], 9) == [1, 2]


def test_a_photo_that_is_seen_through_by_nothing_has_no_mask():
    camera = Camera(orbit_camera(0.0).pose, Intrinsics(9, 9, 4, 3, 8, 6))
    view = view_of('it', np.full((6, 8, 4), 255, np.uint8), camera)
    assert isinstance(view, PhotoView) and view.mask is None and math.isfinite(camera.distance)


@pytest.fixture
def without_rembg(monkeypatch):
    matting._loaded.cache_clear()
    monkeypatch.setitem(sys.modules, 'rembg', None)  # as if it were not installed
    yield
    matting._loaded.cache_clear()


def test_without_rembg_its_background_names_what_to_install(without_rembg):
    view = PhotoView('a', np.zeros((4, 6, 3), np.uint8), Camera(np.eye(4), LENS))
    with pytest.raises(ConfigError, match=r'install it by: pip install "rembg\[cpu\]"'):
        separated(view, 'rembg')


def test_a_stand_in_for_rembg_is_asked_for_masks_alone_and_with_one_network(
        without_rembg, monkeypatch, tmp_path):
    (tmp_path / 'rembg.py').write_text(
        'def new_session():\n    return object()\n\n\n'
        'def remove(image, session, only_mask):\n'
        '    assert only_mask\n    sessions.add(session)\n    return image[..., 0]\n\n\n'
        'sessions = set()\n')
    monkeypatch.delitem(sys.modules, 'rembg')
    monkeypatch.syspath_prepend(tmp_path)
    image = np.zeros((4, 6, 3), np.uint8)
    image[1:3, 2:5, 0] = 255
    for _ in range(2):
        found = separated(PhotoView('a', image, Camera(np.eye(4), LENS)), 'rembg')
        np.testing.assert_array_equal(found.mask, image[..., 0] > 0)
    assert found.mask_source == 'rembg' and len(sys.modules['rembg'].sessions) == 1
    with pytest.raises(ViewError, match='no object: expected one that rembg tells'):
        separated(PhotoView('b', np.zeros_like(image), Camera(np.eye(4), LENS)), 'rembg')
    monkeypatch.delitem(sys.modules, 'rembg')
