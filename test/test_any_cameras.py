"""Views of any cameras: drawn, written, read and framed as the robot frames them."""

import shutil

from active_recon.datasets import framed
from active_recon.datasets.drawn_cameras import draw_camera, filling_distance, TURNTABLE, Viewing
from active_recon.datasets.layout import list_objects, ObjectFolder, write_object
from active_recon.datasets.making import make_dataset, shape_jobs
from active_recon.datasets.views import read_views
from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.geometry.canonical import framed_image, framed_layers, framing_camera
from active_recon.geometry.framing import cube_corners, require_in_image, share_outside
from active_recon.geometry.lenses import Distortion
from active_recon.shapes import make_shape
from active_recon.volumes.binvox import binvox_side
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import VoxelGrid
import cv2
import numpy as np
import pytest
import torch

DRAWN = [draw_camera(rng) for rng in [np.random.default_rng(0)] for _ in range(300)]
ANY = Viewing('any', 4, turned=True)


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Return a folder of four chairs seen by any four cameras each."""
    out = tmp_path_factory.mktemp('any')
    jobs = shape_jobs('chair', range(4), out)
    assert not [each.refusal for each in make_dataset(jobs, 1, fine=True, viewing=ANY)
                if each.refusal]
    return out


@pytest.fixture(scope='module')
def views(made):
    return read_views(list_objects(made), resolution=64, image_size=128, framed=True)


def test_drawn_cameras_stand_in_their_ranges():
    elevations = np.degrees([camera.elevation for camera in DRAWN])
    assert -10 <= elevations.min() < -5 and 75 < elevations.max() <= 85
    focal = [camera.intrinsics.fx / camera.intrinsics.width for camera in DRAWN]
    assert 0.8 <= min(focal) < 0.85 and 2.8 < max(focal) <= 3
    assert min(camera.distance for camera in DRAWN) > 1
    middles = np.array([camera.project(np.zeros((1, 3)))[0][0] for camera in DRAWN]) / 160
    assert 0.35 < middles.min() < 0.42 and 0.58 < middles.max() < 0.65
    outside = np.array([share_outside(camera, 1.0) for camera in DRAWN])
    assert 0.02 < (outside > 0.02).mean() < 0.4
    assert outside.max() < 0.3


def test_the_cube_fills_the_share_of_the_image_that_was_asked_for():
    towards = orbit_camera(0.3, 0.4, 1.0)
    distance = filling_distance(towards, 1.5, 0.7)
    camera = Camera(towards.scaled(distance).pose, Intrinsics(150, 150, 50, 50, 100, 100))
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    assert np.abs(camera.project(corners)[0] - 50).max() == pytest.approx(35, abs=0.01)


def test_an_object_s_cameras_are_those_of_its_name():
    (first, lights), (again, _), (other, _) = (ANY.of(name) for name in ('a', 'a', 'b'))
    np.testing.assert_array_equal([camera.pose for camera in first],
                                  [camera.pose for camera in again])
    assert not np.allclose(first[0].pose, other[0].pose)
    assert np.linalg.norm(lights[0]) == pytest.approx(1)
    assert len(TURNTABLE.of('a')[0]) == 24


def test_every_other_object_stands_turned_where_that_is_asked_for():
    yaws = [ANY.yaw(str(number)) for number in range(200)]
    assert 60 < sum(yaw != 0 for yaw in yaws) < 140
    assert {Viewing('any', 4).yaw(str(number)) for number in range(20)} == {0.0}


def test_a_viewing_that_is_none_is_refused():
    for wrong in (('sphere', 3), ('any', 0)):
        with pytest.raises(ConfigError, match='expected one of turntable, dome, any'):
            Viewing(*wrong)


def test_any_cameras_come_back_as_they_were_written(tmp_path):
    folder = ObjectFolder(tmp_path, 'chair', 'one')
    images = np.zeros((3, 160, 160, 4), np.uint8)
    write_object(folder, images, DRAWN[:3], VoxelGrid(np.ones((32, 32, 32), np.float32), 2.0))
    assert not (folder.images_folder / 'rendering_metadata.txt').exists()
    for read, written in zip(folder.cameras(), DRAWN, strict=False):
        np.testing.assert_allclose(read.pose, written.pose, atol=1e-12)
        assert read.intrinsics == written.intrinsics
    assert folder.grid_side() == 2.0


@pytest.mark.parametrize('text', ['[{}]', '{', '[{"pose": [[1]]}]', '3'])
def test_cameras_that_are_none_are_refused_by_their_path(text, made, tmp_path):
    path = tmp_path / 'ShapeNetRendering' / 'a' / 'b' / 'rendering' / 'cameras.json'
    path.parent.mkdir(parents=True)
    path.write_text(text)
    with pytest.raises(DataError, match='cameras.json: no readable cameras: expected a list'):
        ObjectFolder(tmp_path, 'a', 'b').cameras()


def test_a_binvox_file_without_a_side_is_refused(tmp_path):
    path = tmp_path / 'model.binvox'
    for scale in (b'', b'scale 0\n'):
        path.write_bytes(b'#binvox 1\ndim 2 2 2\n' + scale + b'data\n')
        with pytest.raises(DataError, match=r'model\.binvox: no readable scale: expected'):
            binvox_side(path)


@pytest.mark.parametrize('number', range(4))
def test_training_frames_an_image_as_the_robot_does(number):
    """But for what lies beyond the image, which the robot's repeats."""
    renderer = Renderer(make_shape('chair', 3))
    inside = [camera for camera in DRAWN if share_outside(camera, 1.1) == 0]
    camera = inside[number]
    rgba = renderer.render(camera)
    robot, robot_camera = framed_image(composite(rgba, 0), camera, 1.0, 128)
    layers = composite(rgba, 0)
    trained, seen, target = framed_layers(layers, camera, 1.0, 128)
    np.testing.assert_array_equal(target.pose, robot_camera.pose)
    assert target.intrinsics == robot_camera.intrinsics
    inner = cv2.erode(seen.astype(np.uint8), np.ones((3, 3))) > 0
    apart = np.abs(trained.astype(int) - robot)[inner]
    assert apart.max() <= 8 and apart.mean() < 0.1  # OpenCV's maps count in 1/32 of a pixel


def test_a_framed_image_stands_upright():
    camera = orbit_camera(0.3, 0.2, 2.5, Intrinsics(150, 150, 80, 80, 160, 160))
    _, _, target = framed_layers(np.zeros((160, 160, 4), np.uint8), camera, 1.0, 128)
    np.testing.assert_allclose(target.pose, camera.pose, atol=1e-12)


def test_where_the_image_ends_nothing_is_seen():
    camera = orbit_camera(0.0, 0.0, 2.5, Intrinsics(150, 150, 30, 80, 160, 160))
    layers = np.full((160, 160, 4), 255, np.uint8)
    framed, seen, target = framed_layers(layers, camera, 1.0, 128)
    left_end = target.intrinsics.cx - 30 / 150 * target.intrinsics.fx
    np.testing.assert_array_equal(seen.any(axis=0), np.arange(128) + 0.5 > left_end)
    assert not framed[:, 0].any() and (framed[20:108, 100] == 255).all()


def test_what_is_behind_the_camera_is_not_seen():
    camera = orbit_camera(0.0, 0.0, 2.5, Intrinsics(150, 150, 80, 80, 160, 160))
    away = Camera(camera.pose @ np.diag([1.0, -1, -1, 1]), camera.intrinsics)
    layers, seen, _ = framed_layers(np.full((160, 160, 4), 255, np.uint8), away, 1.0, 128)
    assert not layers.any() and not seen.any()


def test_the_robot_is_told_where_its_image_ends():
    camera = orbit_camera(0.0, 0.0, 2.5, Intrinsics(150, 150, 30, 80, 160, 160))
    image = np.full((160, 160, 3), 200, np.uint8)
    framed, target = framed_image(image, camera, 1.0, 128)
    layers, seen, _ = framed_layers(image, camera, 1.0, 128)
    assert framed.shape == (128, 128, 4)
    np.testing.assert_array_equal(framed[..., 3] > 0, seen)
    assert not framed[~seen].any() and (framed[seen] >= 200).all()
    whole, _ = framed_image(image, orbit_camera(0.0, 0.0, 3.5, Intrinsics(
        150, 150, 80, 80, 160, 160)), 1.0, 128)
    assert whole.shape == (128, 128, 3)


def test_a_cube_that_is_hardly_in_the_image_is_refused():
    camera = orbit_camera(0.0, 0.0, 2.5, Intrinsics(150, 150, -38, 80, 160, 160))
    with pytest.raises(ViewError, match='% of it outside'):
        framed_image(np.zeros((160, 160, 3), np.uint8), camera, 1.0, 128)


def test_a_cube_that_is_in_front_of_a_wide_camera_but_not_of_its_frame_is_refused():
    away = np.array([0.56, 0.45, 0.3])
    looks = np.array([-0.5, 0.1, 0.1]) - away
    looks /= np.linalg.norm(looks)
    right = np.cross(looks, [0, 0, 1]) / np.hypot(*looks[:2])
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(looks, right), looks, away])
    wide = Camera(pose, Intrinsics(200, 200, 320, 240, 640, 480, Distortion(
        'equidistant', (0.0,) * 4)))
    assert wide.project(cube_corners())[1].min() > 0.001
    assert framing_camera(wide).project(cube_corners())[1].min() < 0
    with pytest.raises(ViewError, match="camera in the object's cube or beside it"):
        require_in_image(wide, 1.0, 0.9)


def test_framed_views_are_what_the_cameras_saw(views, made):
    assert views.images.shape == (4, 4, 128, 128, 4)
    assert views.seen.shape == (4, 4, 128, 128)
    assert views.voxels.shape == (4, 64, 64, 64)
    for item, folder in enumerate(views.folders):
        for view, camera in enumerate(folder.cameras()):
            target = framing_camera(camera, 1.0, 128)
            np.testing.assert_allclose(views.poses[item, view], target.pose)
            np.testing.assert_allclose(views.intrinsics[item, view], target.intrinsics.matrix)
            cells = (np.argwhere(views.voxels[item].numpy()) + 0.5) / 64 - 0.5
            column, row = np.floor(target.project(cells)[0]).astype(int).T
            there = (column >= 0) & (column < 128) & (row >= 0) & (row < 128)
            column, row = column[there], row[there]
            seen = views.seen[item, view].numpy()[row, column]
            alpha = views.images[item, view, ..., 3].numpy()
            assert (cv2.dilate(alpha, np.ones((5, 5)))[row, column] > 0)[seen].mean() > 0.98


def test_views_that_are_read_when_shown_are_the_same(views, made):
    lazy = read_views(list_objects(made), resolution=64, image_size=128, framed=True,
                      at_once=False)
    objects, chosen = torch.tensor([2, 0, 2]), torch.tensor([[1, 3, 0], [2, 2, 2]])
    assert lazy.image_size == 128 and lazy.resolution == 64 and len(lazy) == 4
    torch.testing.assert_close(lazy.images[objects, chosen], views.images[objects, chosen])
    torch.testing.assert_close(lazy.seen[objects, chosen], views.seen[objects, chosen])
    torch.testing.assert_close(lazy.voxels[objects], views.voxels[objects])
    torch.testing.assert_close(lazy.poses, views.poses)
    torch.testing.assert_close(lazy.white(objects, chosen[0]), views.white(objects, chosen[0]))


def test_images_beyond_what_memory_may_keep_are_read_again_and_are_the_same(
        views, made, monkeypatch):
    monkeypatch.setattr(framed, '_KEPT_IMAGES', 2 * 5 * 128 ** 2)  # two images
    reads = []
    read = ObjectFolder.image
    monkeypatch.setattr(ObjectFolder, 'image', lambda folder, view: (
        reads.append(view), read(folder, view))[1])
    lazy = read_views(list_objects(made), resolution=64, image_size=128, framed=True,
                      at_once=False)
    objects, chosen = torch.tensor([0, 1, 2, 3]), torch.tensor([0, 1, 2, 0])
    for _ in range(2):
        torch.testing.assert_close(lazy.images[objects, chosen], views.images[objects, chosen])
    count = len(reads)
    assert count > 4  # two threads may find one that is still kept
    last = objects[-1:], chosen[-1:]
    torch.testing.assert_close(lazy.seen[last], views.seen[last])
    assert len(reads) == count  # kept


def test_as_many_views_are_read_as_every_object_has(made, tmp_path):
    jobs = shape_jobs('lamp', range(1), tmp_path)
    list(make_dataset(jobs, 1, fine=True, viewing=Viewing('any', 3)))
    mixed = read_views([*list_objects(made), *list_objects(tmp_path)], resolution=64,
                       image_size=128, framed=True)
    assert mixed.images.shape[:2] == (5, 3)


def test_fewer_views_of_a_turntable_are_still_all_around_and_each_with_its_own_camera(
        made, views, tmp_path):
    list(make_dataset(shape_jobs('lamp', range(1), tmp_path), 1, fine=True))
    folders = list_objects(tmp_path)
    whole = read_views(folders, resolution=64, image_size=128, framed=True)
    mixed = read_views([*list_objects(made), *folders], resolution=64, image_size=128, framed=True)
    every_sixth = slice(0, 24, 6)  # the others have four views
    torch.testing.assert_close(mixed.poses[4], whole.poses[0, every_sixth])
    torch.testing.assert_close(mixed.images[4], whole.images[0, every_sixth])
    torch.testing.assert_close(mixed.images[:4], views.images)


def test_the_turntable_s_views_are_framed_too(tmp_path):
    list(make_dataset(shape_jobs('lamp', range(2), tmp_path), 1))
    views = read_views(list_objects(tmp_path), image_size=128, framed=True)
    assert views.images.shape == (2, 24, 128, 128, 4)
    assert views.images[..., 3].any(-1).any(-1).all()
    white = views.white(torch.tensor([0]), torch.tensor([5]))
    assert white.shape == (1, 4, 128, 128)


def test_objects_that_cannot_be_read_are_listed(made, tmp_path):
    (tmp_path / 'ShapeNetRendering' / 'a' / 'b' / 'rendering').mkdir(parents=True)
    views = read_views([*list_objects(made), *list_objects(tmp_path)], resolution=64,
                       image_size=128, framed=True)
    assert len(views) == 4 and len(views.unreadable) == 1
    with pytest.raises(DataError, match='no readable object'):
        read_views(list_objects(tmp_path), framed=True)


def test_an_object_without_voxels_is_left_out_and_no_other(made, tmp_path):
    folders = list_objects(shutil.copytree(made, tmp_path / 'copy'))
    lacking, short = folders[1].voxels_path(64), folders[2].voxels_path(64)
    lacking.unlink()
    short.write_bytes(b'')
    for at_once in (True, False):
        views = read_views(folders, resolution=64, image_size=128, framed=True, at_once=at_once)
        assert views.folders == (folders[0], *folders[3:])
        assert [reason.partition(': ')[0] for reason in views.unreadable] == [
            str(lacking), str(short)]


def test_any_cameras_are_not_taken_for_a_turntable_s_though_they_are_as_many(tmp_path):
    list(make_dataset(shape_jobs('lamp', range(1), tmp_path), 1, viewing=Viewing('any', 24)))
    with pytest.raises(DataError, match='cameras of another kind: expected'):
        read_views(list_objects(tmp_path))


def test_an_image_of_another_size_than_its_camera_s_is_left_out(made, tmp_path):
    path = shutil.copytree(made, tmp_path / 'copy') / 'ShapeNetRendering/chair/chair-000001'
    image = path / 'rendering' / '02.png'
    cv2.imwrite(str(image), cv2.resize(cv2.imread(str(image), cv2.IMREAD_UNCHANGED), (200, 200)))
    views = read_views(list_objects(tmp_path / 'copy'), resolution=64, image_size=128, framed=True)
    assert len(views) == 3
    assert views.unreadable == (
        f'{image}: wrong size: expected 160 x 160 pixels, as its camera says, got 200 x 200',)
