"""Photos of which nothing is known: COLMAP finds their cameras, and they give a shape."""

import json
import subprocess
import sys

import active_recon
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.photos import sources, structure_from_motion
from active_recon.photos.files import open_photos, photo_paths
from active_recon.photos.options import Options
from active_recon.photos.sources import posed_by, SfmCameras
from active_recon.photos.structure_from_motion import sfm_photos
from active_recon.watching.collection import Collection
from command_line import command, refusal
import cv2
import numpy as np
from photo_scene import thing
from photo_table import centred, LENS, photographed, PRINT
from PIL import ExifTags, Image, ImageOps
import pytest
import trimesh

pytest.importorskip('pycolmap')
COUNT, SIZE, WIDTH, HEIGHT = 10, 0.14, 280, 210
TURNED, ALONE = 4, 'p99.jpg'  # a photo that EXIF turns, and one of nothing


@pytest.fixture(scope='module')
def mesh():
    return centred(thing(), SIZE)


@pytest.fixture(scope='module')
def cameras():
    return [orbit_camera(number * 2 * np.pi / COUNT, 0.45 + 0.15 * (number % 3), 0.45, LENS)
            for number in range(COUNT)]


@pytest.fixture(scope='module')
def folder(mesh, cameras, tmp_path_factory):
    """Return a folder of photos on a newspaper, one of them stored on its side, and of noise."""
    place, rng = tmp_path_factory.mktemp('photos'), np.random.default_rng(0)
    images, _ = photographed(mesh, cameras, PRINT, rng)
    images.append(rng.integers(0, 256, images[0].shape, np.uint8))
    for number, image in enumerate(images):
        photo = Image.fromarray(cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA))
        exif = Image.Exif()
        if number == TURNED:
            photo, exif[ExifTags.Base.Orientation] = photo.transpose(Image.Transpose.ROTATE_90), 6
        name = ALONE if number == COUNT else f'p{number:02}.jpg'
        photo.save(place / name, exif=exif, quality=95)
    return place


@pytest.fixture(scope='module')
def photos(folder):
    return open_photos(photo_paths(folder))[0]


@pytest.fixture(scope='module')
def found(photos):
    return sfm_photos(photos)


def test_the_cameras_are_those_of_the_photos_but_for_place_and_scale(found, cameras):
    _, posed, left_out = found
    assert [each.photo.name for each in posed] == [f'p{number:02}.jpg' for number in range(COUNT)]
    assert left_out == [f'{ALONE}: no camera found: it does not fit the other photos']
    for each in posed:
        assert each.upright and (each.intrinsics.width, each.intrinsics.height) == (WIDTH, HEIGHT)
        assert each.intrinsics.fx == pytest.approx(LENS.fx * WIDTH / LENS.width, rel=0.03)
    own, true = (np.stack(poses) for poses in (
        [each.pose for each in posed], [camera.pose for camera in cameras]))
    left, right = (poses[:, :3, 3] - poses[:, :3, 3].mean(axis=0) for poses in (own, true))
    scale = np.linalg.norm(right) / np.linalg.norm(left)
    rotation = true[0, :3, :3] @ own[0, :3, :3].T
    assert np.abs(scale * left @ rotation.T - right).max() < 0.02 * cameras[0].distance
    turned = rotation @ own[:, :3, :3]
    assert np.abs(turned - true[:, :3, :3]).max() < 0.03


@pytest.fixture
def found_before(found, monkeypatch):
    """Let the cameras of the photos be those that were found, which takes no second search."""
    monkeypatch.setattr(sources, 'sfm_photos', lambda photos, reporting: found)


def test_photos_alone_give_a_shape_that_stands_on_its_table(folder, mesh, found_before):
    shape = active_recon.reconstruct(folder, SfmCameras(), SIZE, views=8)
    assert len(shape.views) == 8 and shape.ground is not None
    *across, high = shape.mesh().extents
    *truly, tall = mesh.extents
    assert high == pytest.approx(tall, rel=0.15)
    assert np.hypot(*across) == pytest.approx(np.hypot(*truly), rel=0.2)
    assert f'{ALONE}: no camera found: it does not fit the other photos' in shape.left_out
    assert not any('scale' in warning for warning in shape.warnings)


def test_where_no_size_is_told_the_side_is_a_metre_and_a_warning_says_so(folder, found_before):
    shape = active_recon.reconstruct(folder, SfmCameras(), views=4, model='carving', ground=False)
    assert shape.size == 1.0
    assert any('the scale is not known' in warning for warning in shape.warnings)


@pytest.mark.slow
def test_the_command_makes_a_mesh_of_photos_alone(folder, tmp_path, monkeypatch, capsys):
    assert command(monkeypatch, 'reconstruct', folder, '--sfm', '--size', SIZE, '--out',
                   tmp_path / 'out') == 0
    assert f'left out: {ALONE}: no camera found' in capsys.readouterr().err
    mesh = trimesh.load(tmp_path / 'out' / 'mesh.ply', process=False)
    assert 0.8 * SIZE < mesh.extents.max() < 1.2 * SIZE


def test_photos_that_do_not_overlap_are_refused_with_what_to_do(tmp_path):
    rng = np.random.default_rng(1)
    for number in range(4):
        Image.fromarray(rng.integers(0, 256, (90, 120, 3), np.uint8)).save(
            tmp_path / f'{number}.png')
    photos = open_photos(photo_paths(tmp_path))[0]
    with pytest.raises(DataError, match='expected 3 photos or more that fit together, got 0 of 4; '
                                        'take 15 or more'):
        sfm_photos(photos)
    with pytest.raises(DataError, match='got 0 of 2'):
        sfm_photos(photos[:2])


def test_where_fewer_than_half_of_the_photos_fit_there_is_no_shape(photos, monkeypatch):
    fit = {f'{number:05}.png': (np.eye(4), None) for number in range(5)}
    monkeypatch.setattr(structure_from_motion, '_cameras', lambda *given: fit)
    with pytest.raises(DataError, match='expected 6 photos or more .*, got 5 of 11'):
        sfm_photos(photos)


def test_what_asks_a_command_to_stop_is_heard_after_the_library_has_come():
    said = subprocess.run([sys.executable, '-c', _STOPPED], capture_output=True, text=True,
                          timeout=60)
    assert (said.returncode, said.stdout, said.stderr) == (0, 'heard\n', '')


_STOPPED = """
import os, signal
from active_recon.photos.structure_from_motion import _library
signal.signal(signal.SIGTERM, lambda *told: print('heard'))
_library()
os.kill(os.getpid(), signal.SIGTERM)
"""


def test_without_the_library_it_is_told_how_to_install_it(photos, monkeypatch):
    monkeypatch.setitem(sys.modules, 'pycolmap', None)
    with pytest.raises(ConfigError, match=r"pip install 'active_recon\[sfm\]'"):
        sfm_photos(photos)


def test_what_needs_known_units_or_one_photo_after_the_other_is_refused(folder, photos):
    with pytest.raises(ConfigError, match='box or unit with structure from motion: .* expected s'):
        active_recon.reconstruct(folder, SfmCameras(), box=(0, 0, 0, 1))
    with pytest.raises(ConfigError, match='axes: without a file of cameras'):
        posed_by(SfmCameras(), photos, 'opengl')
    with pytest.raises(ConfigError, match='structure from motion need all photos at once'):
        Collection(SfmCameras(), Options())


def test_the_command_takes_one_way_to_find_cameras(folder, monkeypatch, capsys):
    said = refusal(monkeypatch, capsys, 'reconstruct', folder, '--sfm', '--board')
    assert 'several of --cameras, --board, --turntable-step-deg and --sfm' in said
    said = refusal(monkeypatch, capsys, 'reconstruct', folder, '--sfm', '--axes', 'opengl')
    assert '--axes with --sfm: it is for a file of cameras' in said


@pytest.mark.slow
def test_a_video_around_the_object_gives_a_mesh_as_photos_do(
        folder, tmp_path, monkeypatch, capsys):
    writer = cv2.VideoWriter(str(tmp_path / 'walk.avi'), cv2.VideoWriter_fourcc(*'MJPG'), 10.0,
                             (WIDTH, HEIGHT))
    for number in range(COUNT):
        with Image.open(folder / f'p{number:02}.jpg') as photo:
            frame = np.asarray(ImageOps.exif_transpose(photo))[..., ::-1]
        for sigma in (3, 0, 3):  # the hand moves before and after
            writer.write(cv2.GaussianBlur(frame, (0, 0), sigma) if sigma else frame)
    writer.release()
    assert command(monkeypatch, 'reconstruct', tmp_path / 'walk.avi', '--sfm', '--frames', COUNT,
                   '--size', SIZE, '--out', tmp_path / 'out') == 0
    told = json.loads((tmp_path / 'out' / 'shape.json').read_text())
    assert [each['photo'] for each in told['views']] == [
        f'walk-{3 * number + 1:05}.png' for number in range(COUNT)]
    mesh = trimesh.load(tmp_path / 'out' / 'mesh.ply', process=False)
    assert 0.8 * SIZE < mesh.extents.max() < 1.2 * SIZE
