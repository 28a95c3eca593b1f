"""An object is reconstructed from photos as they are, wherever it stands in the cameras' world."""

from dataclasses import replace
import errno
import json
import os
from pathlib import Path
import shutil
import sys

import active_recon
from active_recon.bags.replay.verification import verify
from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.photo_run import photo_run
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.run import PHOTOS
from active_recon.bags.runs.run_writing import write_run
from active_recon.cli.main import app
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Camera
from active_recon.meshes.collision import NO_COACD
from active_recon.photos.camera_file import CameraFile
from active_recon.photos.conventions import misreading
from active_recon.photos.cube import first_cube
from active_recon.photos.doubts import doubts
from active_recon.photos.options import Options
from active_recon.photos.picture import shape_picture
from active_recon.photos.reconstruct import from_files, from_views
from active_recon.photos.saving import save_shape
from active_recon.photos.transforms_json import FLIP
from active_recon.photos.views import _mask, view_of
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import REMARK
from active_recon.segmentation import Segmentation, shipped_segmentation
from active_recon.volumes.binvox import read_binvox
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
from judged_quality import quality_of
import numpy as np
from photo_scene import cameras, CENTRE, on_plain, rendered, SIDE, thing, write_photos
from PIL import Image
import pytest
import trimesh
from typer.testing import CliRunner

pytestmark = pytest.mark.usefixtures('loaded_once')
DINO = Path(os.environ.get('ACTIVE_RECON_DINO')
            or Path(__file__).parents[2] / 'shared/data/photos/dino_sparse_ring')
BOX = (*CENTRE, 1.1 * SIDE)
COUNT = 5


@pytest.fixture(scope='module')
def views():
    return cameras(COUNT)


@pytest.fixture(scope='module')
def rgba(views):
    return rendered(views)


@pytest.fixture(scope='module')
def plain(views, rgba, tmp_path_factory):
    """Return a folder of photos before a plain background, with their cameras."""
    return write_photos(tmp_path_factory.mktemp('plain'), views, map(on_plain, rgba))


@pytest.fixture(scope='module')
def shape(plain):
    return active_recon.reconstruct(plain)


@pytest.fixture(scope='module')
def mesh(shape):
    return shape.mesh()


def truth(shape):
    """Return the true cells, in the shape's own cube."""
    mesh = thing()
    mesh.apply_transform(np.linalg.inv(shape.world_from_object))
    mesh.apply_scale(1 / shape.size)
    return voxelise(mesh, len(shape.occupancy)).occupied(0.5)


def test_the_object_and_its_cube_are_found(shape):
    assert len(shape.views) == COUNT and not shape.left_out
    np.testing.assert_allclose(shape.cube.centre, CENTRE, atol=0.05 * SIDE)
    assert SIDE < shape.cube.side < 1.15 * SIDE
    assert iou(shape.occupancy > shape.threshold, truth(shape)) > 0.6
    assert 0 < shape.quality.lower_bound < shape.quality.expected_iou < 1
    assert "plain background's colour" in shape.background


def test_the_mesh_stands_in_the_world_of_the_cameras(shape, mesh):
    mesh = mesh.copy()
    mesh.apply_transform(shape.world_from_object)
    np.testing.assert_allclose(mesh.bounds, thing().bounds, atol=0.15 * SIDE)


def test_the_mesh_is_closed_and_has_the_colours_of_the_photos(mesh, rgba):
    assert mesh.is_watertight and mesh.is_winding_consistent
    photographed = np.concatenate([image[image[..., 3] > 127][:, :3] for image in rgba])
    np.testing.assert_allclose(np.median(mesh.visual.vertex_colors[:, :3], axis=0),
                               np.median(photographed, axis=0), atol=40)


def test_pixels_with_cameras_of_their_own_give_what_the_folder_gives(plain, views, rgba):
    placed = [Camera(np.block([[each.pose[:3, :3], (each.position - CENTRE)[:, None]],
                               [np.zeros((1, 3)), 1]]), each.intrinsics) for each in views]
    own = active_recon.reconstruct([on_plain(image) for image in rgba], placed, BOX[3], views=3)
    stacked = active_recon.reconstruct(
        np.stack([on_plain(image) for image in rgba]), placed, BOX[3], views=3,
        box=np.array([0, 0, 0, BOX[3]]))
    read = active_recon.reconstruct(plain, box=BOX, views=3)
    np.testing.assert_array_equal(stacked.occupancy, own.occupancy)
    np.testing.assert_allclose(own.occupancy, read.occupancy, atol=1e-4)
    assert own.size == read.size == BOX[3]


def test_pixels_without_an_object_or_of_another_size_are_left_out(rgba, views):
    images = [rgba[0], np.zeros_like(rgba[1]), rgba[2][1:]]
    shape = active_recon.reconstruct(images, views[:3], 0.3, box=BOX)
    assert [view.name for view in shape.views] == ['image 1']
    empty, smaller = shape.left_out
    assert empty.startswith('image 2: empty: expected an object in its alpha channel')
    assert smaller.startswith('image 3: wrong image: expected')
    with pytest.raises(DataError, match='no photo can be used: image 1: empty'):
        active_recon.reconstruct(images[1:2], views[1:2], 0.3, box=BOX)


def test_pixels_that_are_filled_anew_leave_the_colours_of_the_mesh(rgba, views):
    images = [on_plain(image) for image in rgba[:3]]
    before = np.stack(images)
    shape = active_recon.reconstruct(images, views[:3], 0.3, background='network', box=BOX)
    for image in images:
        image[:] = 0
    np.testing.assert_array_equal([view.image for view in shape.views], before)


@pytest.fixture(scope='module')
def cluttered(rgba):
    """Return the photos before tiles of any colours."""
    rng = np.random.default_rng(0)
    tiles = [np.kron(rng.integers(0, 256, (9, 12, 3), np.uint8), np.ones((20, 20, 1), np.uint8))
             for _ in rgba]
    return [on_plain(*both) for both in zip(rgba, tiles, strict=True)]


@pytest.fixture(scope='module')
def clutter(views, cluttered, tmp_path_factory):
    """Return a folder of the photos before clutter, with their cameras."""
    return write_photos(tmp_path_factory.mktemp('clutter'), views, cluttered)


@pytest.fixture(scope='module')
def segmented(clutter):
    return active_recon.reconstruct(clutter)


@pytest.mark.parametrize('background', [
    'auto', pytest.param('segment', marks=pytest.mark.slow)])
def test_before_clutter_the_cube_is_found_too(clutter, segmented, background):
    shape = (segmented if background == 'auto'
             else active_recon.reconstruct(clutter, background=background))
    assert shape.background == 'the segmenter' and not shape.left_out
    np.testing.assert_allclose(shape.cube.centre, CENTRE, atol=0.1 * SIDE)
    assert 0.9 * SIDE < shape.cube.side < 1.25 * SIDE
    assert iou(shape.occupancy > shape.threshold, truth(shape)) > 0.5


def test_the_network_alone_finds_an_object_that_is_small_in_its_photos(tmp_path):
    far = cameras(COUNT, 2.2)
    folder = write_photos(tmp_path / 'far', far, map(on_plain, rendered(far)))
    shape = active_recon.reconstruct(folder, background='network')
    assert 0.9 * SIDE < shape.cube.side < 1.25 * SIDE
    assert iou(shape.occupancy > shape.threshold, truth(shape)) > 0.6


@pytest.mark.slow
def test_a_cube_that_is_searched_in_vain_stays_as_wide_as_it_was(views, clutter):
    shape = active_recon.reconstruct(clutter, background='network', ground=False)
    assert shape.cube.side < 1.01 * first_cube(views, np.array([0.0, 0, 1])).side
    assert len(shape.views) == COUNT and shape.quality.suspect == 'object_size'


def test_the_segmenter_looks_at_the_cube_of_the_size_that_is_given(views, cluttered, monkeypatch):
    looked_at = []

    def segmented(given, cube, segmentation, ground):
        looked_at.append(cube.side)
        return given, []

    monkeypatch.setattr('active_recon.photos.reconstruct.segmented_views', segmented)
    photos = [view_of(str(number), *both)
              for number, both in enumerate(zip(cluttered[:2], views[:2], strict=True))]
    shape = from_views(photos, CameraFile('a table', (), metric=True),
                       Options(background='segment', size=2 * SIDE))
    assert looked_at == [shape.cube.side] == [2 * SIDE]


def test_the_segmenter_has_the_threads_that_the_network_has(views, cluttered, monkeypatch):
    shipped, asked = Segmentation.load(threads=1), set()

    def load(threads=None):
        asked.add(threads)
        return shipped

    monkeypatch.setattr('active_recon.segmentation.Segmentation.load', load)
    shipped_segmentation.cache_clear()
    photos = [view_of(str(number), *both)
              for number, both in enumerate(zip(cluttered[:3], views[:3], strict=True))]
    from_views(photos, CameraFile('a table', ()),
               Options(background='segment', threads=1, ground=False))
    shipped_segmentation.cache_clear()
    assert asked == {1}


def test_before_clutter_the_segmenter_finds_the_object_and_a_mask_of_one_photo_tells_otherwise(
        views, rgba, cluttered, clutter):
    ious = {}
    for background in ('auto', 'network'):
        shape = active_recon.reconstruct(clutter, box=BOX, background=background, ground=False)
        ious[shape.background] = iou(shape.occupancy > shape.threshold, truth(shape))
    assert list(ious) == ['the segmenter', "the network's own silhouettes"]
    assert ious['the segmenter'] > max(0.5, ious["the network's own silhouettes"])
    mixed = active_recon.reconstruct(
        [np.dstack([cluttered[0], rgba[0][..., 3]]), *cluttered[1:]], [
            Camera(np.block([[each.pose[:3, :3], (each.position - CENTRE)[:, None]],
                             [np.zeros((1, 3)), 1]]), each.intrinsics) for each in views], BOX[3],
        views=2)
    assert 'alpha channels (1)' in mixed.background and 'own' in mixed.background


def test_a_few_photos_with_an_edge_of_one_colour_are_before_clutter_like_the_others(
        views, rgba, cluttered, tmp_path):
    folder = write_photos(tmp_path / 'mixed', views, [on_plain(rgba[0]), *cluttered[1:]])
    shape = active_recon.reconstruct(folder, box=BOX, views=3, ground=False)
    assert shape.background == 'the segmenter'
    assert iou(shape.occupancy > shape.threshold, truth(shape)) > 0.5


def test_masks_of_files_and_an_alpha_channel_say_the_same(views, rgba, tmp_path):
    with_alpha = write_photos(tmp_path / 'alpha', views, rgba)
    without = write_photos(tmp_path / 'rgb', views, [image[..., :3] for image in rgba])
    (tmp_path / 'masks').mkdir()
    for number, image in enumerate(rgba):
        Image.fromarray(np.where(image[..., 3] > 127, 255, 0).astype(np.uint8)).save(
            tmp_path / 'masks' / f'photo{number}.png')
    alpha = active_recon.reconstruct(with_alpha, box=BOX, views=2)
    files = active_recon.reconstruct(without, box=BOX, views=2, masks=tmp_path / 'masks')
    assert alpha.background == 'alpha channels' and files.background == 'masks from files'
    np.testing.assert_array_equal(alpha.occupancy, files.occupancy)


@pytest.mark.parametrize(('count', 'model'), [(2, 'lifting'), (4, 'carving')])
def test_masks_that_contradict_are_told_of_with_two_photos_and_without_tables_of_quality(
        count, model, views, rgba):
    images = [image.copy() for image in rgba[:count]]
    images[1][..., 3] = np.roll(images[1][..., 3], 40, 0)
    placed = [Camera(view.pose, view.intrinsics) for view in views[:count]]
    posed = [view_of(f'photo{number}', image, camera)
             for number, (image, camera) in enumerate(zip(images, placed, strict=True))]
    shape = from_views(posed, CameraFile('cameras', ()), Options(
        box=BOX, up='z', model=model, ground=False))
    assert any('masks contradict each other' in warning for warning in shape.warnings)


@pytest.mark.parametrize(('off', 'said'), [
    (0, "the network's own silhouettes, cut by a plain background's colour"),
    (40, "the network's own silhouettes")])
def test_a_plain_background_is_said_to_cut_only_where_it_does(off, said, views, rgba):
    images = [on_plain(image) for image in rgba[:3]]
    images[1] = np.roll(images[1], off, 0)
    posed = [view_of(f'photo{number}', image, view)
             for number, (image, view) in enumerate(zip(images, views, strict=False))]
    shape = from_views(posed, CameraFile('cameras', ()), Options(
        box=BOX, up='z', model='carving', ground=False))
    assert shape.background == said
    assert all(('plain' in view.background) == ('plain' in said) for view in shape.views)


@pytest.mark.parametrize(('model', 'warned'), [('2d3d', True), ('carving', False)])
def test_only_networks_that_need_the_front_warn_that_photos_do_not_tell_it(plain, model, warned):
    shape = active_recon.reconstruct(plain, views=1, box=(*CENTRE, SIDE), model=model)
    assert warned == any("needs the object's front" in warning for warning in shape.warnings)


def test_what_the_runtime_has_to_say_is_a_warning(plain, monkeypatch):
    monkeypatch.setattr(Reconstructor, 'provenance', {REMARK: 'torch instead'})
    shape = active_recon.reconstruct(plain, views=1, box=(*CENTRE, SIDE), model='carving')
    assert 'torch instead' in shape.warnings


def test_the_size_sets_the_scale_alone(plain, shape, mesh):
    twice = active_recon.reconstruct(plain, size=2 * shape.size)
    np.testing.assert_allclose(twice.occupancy, shape.occupancy, atol=1e-4)
    np.testing.assert_allclose(twice.mesh().extents, 2 * mesh.extents, rtol=1e-2)
    box = Options(box=BOX, unit=1000.0, views=1)
    assert from_files(plain, None, box).size == pytest.approx(1000 * BOX[3])


def test_an_object_that_fills_its_photos_is_not_refused(tmp_path):
    near = cameras(COUNT, distance=0.55)
    folder = write_photos(tmp_path / 'near', near, map(on_plain, rendered(near)))
    shape = active_recon.reconstruct(folder)
    assert len(shape.views) == COUNT and not shape.left_out
    assert iou(shape.occupancy > shape.threshold, truth(shape)) > 0.5


def changed(plain, folder, change):
    """Return a copy of the cameras' file with each matrix changed."""
    content = json.loads((plain / 'transforms.json').read_text())
    for frame in content['frames']:
        frame['transform_matrix'] = change(np.array(frame['transform_matrix'])).tolist()
    path = folder / 'transforms.json'
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(('change', 'expected'), [
    (lambda pose: pose @ np.diag([1.0, -1, -1, 1]),
     "the other camera axes .OpenCV's instead of OpenGL's. would fit: give --axes opencv$"),
    (np.linalg.inv, 'camera from world would fit.*: invert')])
def test_poses_of_another_convention_are_refused_with_the_one_that_fits(
        change, expected, plain, tmp_path):
    path = changed(plain, tmp_path, change)
    with pytest.raises(DataError, match=f'the cameras do not look at one object: {expected}'):
        active_recon.reconstruct(plain, path)


@pytest.mark.parametrize(('given', 'fitting'), [('opencv', 'opengl'), ('opengl', 'opencv')])
def test_axes_that_were_given_wrongly_are_refused_with_those_that_fit(
        given, fitting, plain, tmp_path):
    flips = given == 'opengl'  # the photos' own file has OpenGL's axes
    path = changed(plain, tmp_path, lambda pose: pose @ FLIP if flips else pose)
    with pytest.raises(DataError, match=f'would fit: give --axes {fitting}$'):
        from_files(plain, path, Options(axes=given))
    with pytest.raises(DataError, match=f'would fit: give --axes {fitting}$'):
        from_files(plain, path, Options(axes=given, box=BOX))


@pytest.mark.parametrize(('looks', 'fitting'), [('opencv', 'opengl'), ('opengl', 'opencv')])
def test_matrices_that_are_inverse_and_of_other_axes_fit_as_is_advised(looks, fitting, views):
    def read(matrix, axes):
        return Camera(matrix @ FLIP if axes == 'opengl' else matrix, views[0].intrinsics)

    written = [np.linalg.inv(read(view.pose, fitting).pose) for view in views]
    assert misreading([read(matrix, looks) for matrix in written], CENTRE, looks).endswith(
        f'invert the matrices and give --axes {fitting}')
    assert not misreading([read(np.linalg.inv(matrix), fitting) for matrix in written], CENTRE,
                          fitting)


def test_the_axes_that_fit_can_be_given(plain, tmp_path, shape):
    path = changed(plain, tmp_path, lambda pose: pose @ np.diag([1.0, -1, -1, 1]))
    other = active_recon.reconstruct(plain, path, axes='opencv')
    np.testing.assert_allclose(other.occupancy, shape.occupancy, atol=1e-6)


def test_photos_that_are_upside_down_are_noticed(views, rgba, tmp_path, shape):
    turned = [np.ascontiguousarray(image[::-1, ::-1]) for image in rgba]
    folder = write_photos(tmp_path / 'turned', views, turned)
    found = active_recon.reconstruct(folder, box=BOX).warnings
    told = 'photos turned by 180 degrees would fit'
    assert any(told in warning for warning in found)
    assert not any(told in warning for warning in shape.warnings)
    # One object in twenty is unusual to the quality without a fault; nothing else is warned of
    assert all(warning.startswith('unusual views') for warning in shape.warnings)


def test_a_cube_that_does_not_fit_is_asked_for_by_the_options_of_the_command(shape):
    last = shape.views[-1]
    judged = replace(last, known=replace(
        last.known, judge=lambda: quality_of(suspect='object_size')))
    assert doubts([judged], [], shape.cube, None, 'auto', 1.0, 'opencv') == [
        'unusual views (p = 0.010): the object does not fit its cube: is the cube (--box, --size) '
        'right?']


def test_what_is_wrong_with_photos_is_one_line_each_and_the_others_are_used(plain, tmp_path):
    folder = shutil.copytree(plain, tmp_path / 'some')
    (folder / 'broken.jpg').write_bytes(b'no photo')
    shutil.copy(folder / 'photo1.png', folder / 'photo9.png')
    Image.new('RGB', (30, 20)).save(folder / 'other.png')
    shape = active_recon.reconstruct(folder, box=BOX)
    assert [view.name for view in shape.views] == [f'photo{number}.png'
                                                   for number in range(COUNT)]
    said = sorted(shape.left_out)
    assert len(said) == 3 and not any('\n' in reason for reason in said)
    assert 'broken.jpg: not readable' in said[0]
    assert 'other.png: no camera in' in said[1]
    assert said[2] == 'photo9.png: the same photo as photo1.png'


def test_an_error_names_the_photos_that_were_left_out_before_it(plain, tmp_path):
    shutil.copytree(plain, tmp_path / 'some')
    for path in sorted((tmp_path / 'some').glob('*.png'))[1:]:
        path.rename(path.with_suffix('.dng'))
    with pytest.raises(DataError, match=rf'got 1 that look the same way; .*\. Left out before, '
                                        rf'{COUNT - 1}: photo1.dng: not readable'):
        active_recon.reconstruct(tmp_path / 'some')


def test_a_single_photo_needs_the_place_of_the_object(plain, views):
    with pytest.raises(DataError, match='object not found: .* give its place by --box'):
        active_recon.reconstruct(plain, views=1)
    assert active_recon.reconstruct(plain, views=1, box=BOX).occupancy.any()


def test_a_place_without_an_object_is_refused(plain, rgba, views, tmp_path):
    empty = [np.zeros_like(image[..., :3]) + np.uint8([200, 200, 200]) for image in rgba]
    for number, image in enumerate(empty):
        image[0, 0] = number  # else they are the same photo
    folder = write_photos(tmp_path / 'empty', views, empty)
    with pytest.raises(DataError, match='object not found'):
        active_recon.reconstruct(folder)


@pytest.mark.parametrize(('how', 'expected'), [
    ({'background': 'green'}, 'background: unknown value'), ({'size': -1}, 'size: out of range'),
    ({'box': (0, 0, 1)}, 'box: expected four numbers'), ({'views': 0}, 'views: out of range'),
    ({'size': '0.2'}, "size: no number: .*, got '0.2'"), ({'views': 2.5}, 'views: no number'),
    ({'threads': '2'}, 'threads: no number'), ({'box': (0, 0, '0', 1)}, 'box: expected four'),
    ({'box': 1}, 'box: expected four numbers'), ({'up': 'w'}, 'up: not an axis'),
    ({'size': 0.3, 'unit': 0.1}, 'both set the scale')])
def test_options_that_cannot_be_are_refused(how, expected, plain):
    with pytest.raises(ConfigError, match=expected):
        active_recon.reconstruct(plain, **how)


@pytest.mark.parametrize('how', [{'masks': 'masks'}, {'unit': 0.001}, {'order': 'time'},
                                 {'axes': 'opengl'}])
def test_what_is_for_files_is_refused_beside_pixels(how, rgba, views):
    with pytest.raises(ConfigError, match='not for images with cameras of their own'):
        active_recon.reconstruct(rgba[:1], views[:1], 0.3, **how)


def test_images_and_cameras_may_be_any_iterables_and_nothing_else(rgba, views):
    shape = active_recon.reconstruct(iter(rgba[:2]), iter(views[:2]), BOX[3], box=BOX,
                                     model='carving')
    assert len(shape.views) == 2
    for images, given in ((3, None), (None, views[:1]), (rgba[:1], 3)):
        with pytest.raises(ConfigError, match='s: expected a list with .*, got (int|NoneType)$'):
            active_recon.reconstruct(images, given, 0.3)


def test_pixels_without_cameras_are_refused(rgba, views):
    with pytest.raises(ConfigError, match='expected a camera for each image'):
        active_recon.reconstruct([rgba[0]])
    with pytest.raises(ConfigError, match='size: missing'):
        active_recon.reconstruct([rgba[0]], views[:1])
    with pytest.raises(ConfigError, match='expected one for each of 2 images, got 1'):
        active_recon.reconstruct(rgba[:2], views[:1], 0.3)
    with pytest.raises(ConfigError, match='image 1: expected pixels, .*, got list$'):
        active_recon.reconstruct([rgba[0].tolist()], views[:1], 0.3)
    for given in (views[0], [views[0].pose], np.array([views[0].pose])):
        with pytest.raises(ConfigError, match=r'a Camera\(pose, intrinsics\) for each image, got'):
            active_recon.reconstruct(rgba[:1], given, 0.3)


def test_the_bag_of_the_photos_replays_bit_by_bit(shape, tmp_path):
    write_run(photo_run(shape, tmp_path / 'bag'), tmp_path / 'bag')
    run = read_run(tmp_path / 'bag')
    setup = recorded_setup(run)
    found = verify(run, setup.load_reconstructor(), setup.load_planner())
    assert run.episodes[0].done == PHOTOS  # by which a report knows it
    assert found.view_count == COUNT
    assert {each.verdict for each in found.comparison.deviations.values()
            if each.compared} == {'same bits'}


def test_the_picture_shows_each_photo_over_the_shape(shape):
    picture = shape_picture(shape)
    assert picture.dtype == np.uint8 and picture.shape[1] > 4 * picture.shape[0] / 2
    assert (np.abs(picture - [217.0, 95, 2]).max(axis=2) < 60).any()  # the outline


def test_a_folder_that_cannot_be_made_is_told(shape, tmp_path):
    (tmp_path / 'out').write_text('a file')
    with pytest.raises(DataError, match='out: not written: expected a folder with room'):
        save_shape(shape, tmp_path / 'out')


def test_a_description_that_finds_no_room_leaves_the_one_that_stood_there(
        shape, tmp_path, monkeypatch):
    save_shape(shape, tmp_path)
    before = (tmp_path / 'shape.json').read_text()
    whole = Path.write_text

    def full(path, text):
        whole(path, text[:5])
        raise OSError(errno.ENOSPC, 'no space left')

    monkeypatch.setattr(Path, 'write_text', full)
    with pytest.raises(DataError, match='not written: expected a folder with room'):
        save_shape(shape, tmp_path)
    assert (tmp_path / 'shape.json').read_text() == before


def test_the_command_says_what_a_robot_description_lacks(shape, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'coacd', None)
    monkeypatch.setattr('active_recon.photos.reconstruct.from_files', lambda *how: shape)
    said = CliRunner().invoke(app, ['reconstruct', str(tmp_path), '--out', str(tmp_path / 'out'),
                                    '--mesh-format', 'urdf'])
    assert said.exit_code == 0 and NO_COACD in said.output


def test_the_command_tells_what_is_of_an_earlier_run(shape, tmp_path, monkeypatch):
    monkeypatch.setattr('active_recon.photos.reconstruct.from_files', lambda *how: shape)
    run = ['reconstruct', str(tmp_path), '--out', str(tmp_path / 'out'), '--mesh-format']
    assert 'earlier run' not in CliRunner().invoke(app, [*run, 'ply', '--bag']).output
    said = CliRunner().invoke(app, [*run, 'glb']).output
    for name in ('mesh.ply', 'bag', 'report.html'):
        assert f'{tmp_path / "out" / name} is of an earlier run' in said
    assert said.count('earlier run') == 3


def test_the_command_writes_all_files(plain, tmp_path):
    out = tmp_path / 'out'
    result = CliRunner().invoke(app, [
        'reconstruct', str(plain), '--out', str(out), '--views', '3', '--bag',
        '--box', ','.join(map(str, BOX)), '--mesh-format', 'obj'])
    assert result.exit_code == 0, result.output
    assert '3 photos; silhouettes: the network' in result.output
    assert 'quality: expected IoU' in result.output
    assert {path.name for path in out.iterdir()} == {
        'mesh.obj', 'voxels.npz', 'voxels.binvox', 'picture.png', 'shape.json', 'bag',
        'report.html'}
    said = json.loads((out / 'shape.json').read_text())
    assert said['size_m'] == pytest.approx(BOX[3]) and len(said['views']) == 3
    cells = read_binvox(out / 'voxels.binvox')
    with np.load(out / 'voxels.npz') as voxels:
        np.testing.assert_array_equal(cells.occupied(0.5),
                                      voxels['occupancy'] > voxels['threshold'])
    assert trimesh.load(out / 'mesh.obj').extents.max() < BOX[3]
    page = (out / 'report.html').read_text()
    assert 'This run was made of 3 photos with known cameras.' in page


@pytest.mark.parametrize(('arguments', 'expected'), [
    (['--box', '1,2'], '--box: invalid cube'), (['--board', '--cameras', 'x'], 'several of'),
    (['--turntable-step-deg', '10'], 'needs --distance'),
    (['--size', '1', '--unit', '2'], '--size and --unit'),
    (['--camera-info', 'lens.yaml'], '--camera-info without --board'),
    (['--fov-deg', '40'], '--fov-deg without --turntable-step-deg'),
    (['--elevation-deg', '30', '--distance', '1'],
     '--elevation-deg, --distance without --turntable-step-deg'),
    (['--squares', '9x7', '--square-mm', '22'], '--squares, --square-mm without --board'),
    (['--max-views', '5', '--lan'], '--lan, --max-views without --watch'),
    (['--watch', '--order', 'time'], '--order with --watch'),
    (['--masks', 'masks', '--background', 'segment'], 'masks with the background segment'),
    (['--board', '--axes', 'opengl'], '--axes with --board'),
    (['--turntable-step-deg', '10', '--distance', '1', '--axes', 'opengl'],
     '--axes with --turntable-step-deg'),
    (['--mesh-format', 'doc'], '--mesh-format: unknown value')])
def test_options_of_the_command_that_contradict_each_other_are_refused(
        arguments, expected, plain, tmp_path):
    result = CliRunner().invoke(app, ['reconstruct', str(plain), '--out', str(tmp_path / 'out'),
                                      *arguments])
    assert isinstance(result.exception, ConfigError) and expected in str(result.exception)
    assert not (tmp_path / 'out').exists()


def test_a_cube_of_another_side_than_the_size_is_refused_where_units_are_metres():
    board = CameraFile('board', (), np.array([0.0, 0.0, 1.0]), metric=True)
    with pytest.raises(ConfigError, match='box and size: .* got sides of 0.2 and 0.3 m'):
        from_views([], board, Options(box=(0, 0, 0.1, 0.2), size=0.3))


def test_a_file_in_place_of_the_folder_to_write_is_refused_before_any_work(tmp_path):
    out = tmp_path / 'out'
    out.touch()
    result = CliRunner().invoke(app, ['reconstruct', str(tmp_path), '--out', str(out)])
    assert isinstance(result.exception, ConfigError)
    assert '--out: no folder' in str(result.exception)


@pytest.mark.skipif(not DINO.is_dir(), reason='needs dinoSparseRing of Middlebury: name it by '
                                             'ACTIVE_RECON_DINO')
@pytest.mark.parametrize(('background', 'least'), [
    ('auto', 0.77), pytest.param('plain', 0.77, marks=pytest.mark.slow)])
def test_five_photos_of_the_dinosaur_are_near_the_hull_of_all(background, least):
    from active_recon.datasets.middlebury import read_photographs
    from active_recon.evaluation.posed.photographs import averaged, hull
    shape = active_recon.reconstruct(DINO, views=5, background=background)
    dino = read_photographs(DINO)
    assert shape.size == pytest.approx(0.0949, abs=1e-3)  # by README.txt
    cells = averaged(shape.occupancy, 32) > shape.threshold
    assert iou(cells, hull(dino, range(16))) > least


def test_the_folder_of_photos_is_not_written_to(plain):
    result = CliRunner().invoke(app, ['reconstruct', str(plain), '--out', f'{plain}/.'])
    assert isinstance(result.exception, ConfigError) and '--out: the folder of photos' in str(
        result.exception)
    assert not (plain / 'picture.png').exists()


@pytest.mark.parametrize('full', [1, 255, 65535])
def test_a_mask_is_the_object_where_it_is_more_than_half_of_its_full_value(full, tmp_path):
    shares = np.linspace(0, 1, 8)[None].repeat(8, axis=0)
    levels = np.rint(full * shares).astype(np.uint8 if full == 1 else np.uint16)
    Image.fromarray(levels).save(tmp_path / 'mask.png')
    np.testing.assert_array_equal(_mask(tmp_path / 'mask.png', 8, 8), shares > 0.5)


@pytest.mark.parametrize('mode', ['P', 'RGB'])
def test_a_mask_of_coloured_labels_is_the_object_wherever_it_is_not_black(mode, tmp_path):
    labels = np.zeros((8, 8), np.uint8)
    labels[2:5, 3:6], labels[5, 3:6] = 1, 2
    mask = Image.fromarray(labels)
    mask.putpalette([0, 0, 0, 128, 0, 0, 0, 0, 255])  # dark red and blue
    mask.convert(mode).save(tmp_path / 'mask.png')
    np.testing.assert_array_equal(_mask(tmp_path / 'mask.png', 8, 8), labels > 0)


def test_a_palette_that_is_see_through_masks_like_an_alpha_channel(tmp_path):
    clear = np.zeros((8, 8), np.uint8)
    clear[2:5, 3:6] = 1
    mask = Image.fromarray(clear)
    mask.putpalette([90, 90, 90, 20, 20, 20])
    mask.save(tmp_path / 'mask.png', transparency=0)
    np.testing.assert_array_equal(_mask(tmp_path / 'mask.png', 8, 8), clear > 0)


def test_an_empty_mask_is_refused_with_how_bright_an_object_is(tmp_path):
    Image.fromarray(np.full((8, 8), 2, np.uint8)).save(tmp_path / 'mask.png')
    with pytest.raises(DataError, match='expected an object, brighter than 127.5 of 255, got at '
                                        'most 2'):
        _mask(tmp_path / 'mask.png', 8, 8)


def test_an_opaque_alpha_channel_is_no_mask(tmp_path):
    grey = np.zeros((8, 8), np.uint8)
    grey[2:5, 3:6] = 255
    for name, alpha in (('opaque', np.full_like(grey, 255)), ('clear', grey)):
        shown = grey if name == 'opaque' else np.full_like(grey, 7)
        Image.fromarray(np.dstack([shown] * 3 + [alpha])).save(tmp_path / f'{name}.png')
        np.testing.assert_array_equal(_mask(tmp_path / f'{name}.png', 8, 8), grey > 0)
