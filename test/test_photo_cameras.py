"""Every format of cameras says the same of the same cameras, and what is no camera is refused."""

from dataclasses import replace
import json
from pathlib import Path
import re
import shutil
import struct
import subprocess
import sys
import unicodedata

from active_recon.errors import ConfigError, DataError, ViewError
from active_recon.geometry.cameras import Intrinsics
from active_recon.geometry.lenses import Distortion
from active_recon.photos.camera_file import CameraFile, Entry, posed_photos, sized
from active_recon.photos.colmap import read_colmap
from active_recon.photos.cube import upward
from active_recon.photos.files import open_photos, photo_paths
from active_recon.photos.readers import find_cameras, read_cameras
from active_recon.photos.sources import posed_by
from active_recon.photos.transforms_json import read_transforms
import numpy as np
from photo_rigs import (
    blank_photos,
    LENS,
    names,
    PINHOLE,
    rig,
    transforms,
    write_middlebury,
    write_opencv,
    write_transforms,
)
from PIL import ExifTags, Image
import pytest

COLMAP = Path(__file__).parent / 'colmap'


@pytest.fixture(scope='module')
def photos(tmp_path_factory):
    return open_photos(photo_paths(blank_photos(tmp_path_factory.mktemp('photos'), rig())))[0]


def assert_same(path, photos, cameras, axes=None):
    posed, left_out = posed_photos(read_cameras(path, photos, axes), photos)
    assert not left_out and [each.photo.name for each in posed] == names(cameras)
    for own, true in zip(posed, cameras, strict=True):
        np.testing.assert_allclose(own.pose, true.pose, atol=1e-9)
        lens, expected = own.intrinsics, true.intrinsics
        np.testing.assert_allclose(lens.matrix, expected.matrix, atol=1e-9)
        assert (lens.width, lens.height) == (expected.width, expected.height)
        if expected.distortion is None:
            assert lens.distortion is None
        else:
            points = np.array([[0.3, -0.2], [-0.4, 0.3]])
            np.testing.assert_allclose(lens.distortion.distort(points),
                                       expected.distortion.distort(points), atol=1e-12)


@pytest.mark.parametrize('kind', ['text', 'binary'])
def test_a_colmap_model_has_the_cameras_it_was_written_from(kind, photos):
    assert_same(COLMAP / kind, photos, rig())
    model = read_colmap(COLMAP / kind)
    assert model.up is None  # the photos tell, or the table in them
    assert upward([entry.pose for entry in model.entries])[2] > 0.9


def test_all_cameras_of_a_model_tell_what_is_up_unless_exif_turns_a_photo(tmp_path):
    path = blank_photos(tmp_path, rig()) / 'photo0.png'
    file, _, _ = posed_by(COLMAP / 'text', open_photos([path])[0])
    assert len(file.entries) == 4 and not file.as_seen
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    Image.open(path).save(path, exif=exif)
    file, [posed], _ = posed_by(COLMAP / 'text', open_photos([path])[0])
    np.testing.assert_array_equal(file.as_seen, [posed.as_seen])
    np.testing.assert_array_equal(posed.as_seen[:3, 1], posed.pose[:3, 0])


@pytest.mark.parametrize('shared', [True, False])
@pytest.mark.parametrize('suffix', [True, False])
def test_transforms_have_the_cameras_they_were_written_from(shared, suffix, photos, tmp_path):
    path = write_transforms(tmp_path / 'transforms.json', rig(), shared=shared, suffix=suffix)
    assert_same(path, photos, rig())
    assert_same(tmp_path, photos, rig())  # found in its folder


def test_a_name_without_a_suffix_may_have_dots(photos, tmp_path):
    content = transforms(rig())
    named = []
    for number, (frame, photo) in enumerate(zip(content['frames'], photos, strict=True)):
        frame['file_path'] = f'images/frame.{number:04}'
        named.append(replace(photo, path=photo.path.with_name(f'frame.{number:04}.png')))
    (tmp_path / 'transforms.json').write_text(json.dumps(content))
    posed, left_out = posed_photos(read_transforms(tmp_path / 'transforms.json'), named)
    assert not left_out
    for each, camera in zip(posed, rig(), strict=True):
        np.testing.assert_allclose(each.pose, camera.pose, atol=1e-9)


@pytest.mark.parametrize('named', [True, False])
@pytest.mark.parametrize('suffix', ['yml', 'xml', 'yaml', 'json'])
def test_what_opencv_writes_has_the_cameras_it_was_written_from(named, suffix, photos, tmp_path):
    assert_same(write_opencv(tmp_path / f'cameras.{suffix}', rig(), named), photos, rig())


def test_a_name_that_is_not_of_utf_8_is_refused_with_its_file(photos, tmp_path):
    path = write_opencv(tmp_path / 'cameras.yml', rig())
    path.write_bytes(path.read_bytes().replace(b'photo2', 'für2'.encode('latin-1')))
    with pytest.raises(DataError, match=r"cameras.yml: .*names in UTF-8, got b'f\\xfcr2.png'"):
        read_cameras(path, photos)


def test_a_fisheye_of_opencv_is_one_and_a_tilted_sensor_is_refused_by_its_count(photos, tmp_path):
    fisheye = replace(LENS, distortion=Distortion('equidistant', (0.1, -0.05, 0.02, -0.01)))
    path = write_opencv(tmp_path / 'cameras.yml', rig(fisheye))
    path.write_text(path.read_text() + 'fisheye_model: 1\n')
    assert_same(path, photos, rig(fisheye))
    tilted = replace(LENS, distortion=Distortion('rational_polynomial', (0.1,) * 12))
    object.__setattr__(tilted.distortion, 'coefficients', (0.1,) * 14)
    with pytest.raises(DataError, match='expected 8 or 12 of rational_polynomial, got 14'):
        read_cameras(write_opencv(tmp_path / 'tilted.yml', rig(tilted)), photos)


def test_middlebury_s_file_has_the_cameras_it_was_written_from(photos, tmp_path):
    assert_same(write_middlebury(tmp_path / 'it_par.txt', rig(PINHOLE)), photos, rig(PINHOLE))


def test_a_field_of_view_is_a_focal_length(photos, tmp_path):
    path = tmp_path / 'transforms.json'
    content = transforms(rig(PINHOLE))
    angle = 2 * np.arctan(PINHOLE.width / 2 / PINHOLE.fx)
    path.write_text(json.dumps({'camera_angle_x': angle, 'frames': content['frames']}))
    assert_same(path, photos, rig(PINHOLE))


def test_a_field_of_view_of_a_photo_whose_size_is_told_is_that_of_a_smaller_one(photos, tmp_path):
    twice = PINHOLE.resized(2 * PINHOLE.width, 2 * PINHOLE.height)
    path = tmp_path / 'transforms.json'
    path.write_text(json.dumps({
        'camera_angle_x': 2 * np.arctan(PINHOLE.width / 2 / PINHOLE.fx), 'w': twice.width,
        'h': twice.height, 'cx': twice.cx, 'cy': twice.cy,
        'frames': transforms(rig(PINHOLE))['frames']}))
    assert_same(path, photos, rig(PINHOLE))


def test_photos_of_one_name_are_told_by_their_folders(tmp_path):
    entries, paths = [], []
    for number, camera in enumerate(rig(PINHOLE)):
        blank_photos(tmp_path / f'cam{number}', [camera], 90 + number)
        paths.append(tmp_path / f'cam{number}' / names([camera])[0])
        entries.append(Entry(f'cam{number}/photo0.png', camera.pose, sized(PINHOLE)))
    posed, left_out = posed_photos(CameraFile('it', entries[::-1]), open_photos(paths)[0])
    assert len(posed) == 4 and not left_out
    for each, path, camera in zip(posed, paths, rig(PINHOLE), strict=True):
        assert each.photo.path == path
        np.testing.assert_array_equal(each.pose, camera.pose)


def test_a_scaled_photo_has_a_scaled_lens_and_another_shape_none(tmp_path):
    lens = sized(LENS)
    assert lens((640, 480)).fx == 2 * LENS.fx
    with pytest.raises(ViewError, match='another size: expected 320 x 240 pixels'):
        lens((240, 320))


def test_other_axes_are_a_half_turn_about_x(photos, tmp_path):
    path = write_transforms(tmp_path / 'transforms.json', rig())
    assert_same(path, photos, rig(), axes='opengl')
    own, other = read_cameras(path, photos), read_cameras(path, photos, 'opencv')
    np.testing.assert_allclose(other.entries[0].pose[:3, :3],
                               own.entries[0].pose[:3, :3] * [1, -1, -1])
    with pytest.raises(ConfigError, match='expected one of opencv, opengl'):
        read_cameras(path, photos, 'directx')


def test_photos_without_a_camera_are_named_and_the_others_used(photos, tmp_path):
    content = rig()[:2]
    posed, left_out = posed_photos(
        read_cameras(write_transforms(tmp_path / 'transforms.json', content), photos), photos)
    assert len(posed) == 2
    assert left_out[0].startswith('photo2.png: no camera in ') and len(left_out) == 2


def test_cameras_of_other_photos_are_refused(photos):
    entries = [Entry('other/cat.jpg', np.eye(4), sized(LENS))]
    with pytest.raises(DataError, match=r'cameras of other photos: expected some of photo0.png, '
                                        r'\.\.\., got those of other/cat.jpg'):
        posed_photos(CameraFile('file', entries), photos)


def test_cameras_are_found_beside_the_photos(tmp_path):
    assert find_cameras([tmp_path, tmp_path / 'none']) is None
    (tmp_path / 'sparse/0').mkdir(parents=True)
    (tmp_path / 'sparse/0/images.bin').touch()
    assert find_cameras([tmp_path]) == tmp_path / 'sparse/0'
    (tmp_path / 'transforms.json').touch()
    assert find_cameras([tmp_path]) == tmp_path / 'transforms.json'


@pytest.mark.parametrize('name', ('cameras.yaml', 'cameras.yml', 'cameras.xml', 'cup_par.txt'))
def test_cameras_are_found_whatever_macos_has_put_beside_them(name, tmp_path):
    (tmp_path / f'._{name}').touch()
    assert find_cameras([tmp_path]) is None
    (tmp_path / name).touch()
    assert find_cameras([tmp_path]) == tmp_path / name


def test_an_umlaut_of_two_characters_is_that_of_one(tmp_path):
    names = [unicodedata.normalize('NFD', f'Büste {number}.png') for number in range(3)]
    for number, name in enumerate(names):
        Image.new('RGB', (40, 30), (number, 0, 0)).save(tmp_path / name)
    photos = open_photos([tmp_path / name for name in names])[0]
    lens = sized(Intrinsics(50, 50, 20, 15, 40, 30))
    entries = [Entry(unicodedata.normalize('NFC', name), np.eye(4), lens) for name in names]
    posed, left_out = posed_photos(CameraFile('it', entries), photos)
    assert len(posed) == 3 and not left_out


@pytest.mark.parametrize(('change', 'expected'), [
    ({'frames': []}, 'expected JSON with a list `frames`'),
    ({'camera_model': 'EQUIRECTANGULAR'}, 'camera_model EQUIRECTANGULAR: expected one of'),
    ({'fl_x': -3}, 'frame 0: no camera: .*fl_x of -3.0: expected a number above 0'),
    ({'k4': 0.1}, 'k4 of a lens that is no fisheye'),
    ({'w': 0}, 'frame 0: no camera: .*w of 0.0: expected a number above 0'),
    ({'h': float('inf')}, 'frame 0: no camera: .*h of inf: expected a number above 0'),
    ({'cx': float('nan')}, 'frame 0: no camera: .*cx, cy of nan'),
    ({'fl_x': 1e400}, 'fl_x of inf'),
    ({'k1': None}, 'frame 0: no camera: .*got: k1 of None: expected a number'),
    ({'frames': ['a.png']}, "frame 0: no camera: .*got: 'a.png'"),
    ({'frames': [{'file_path': 'a.png'}]},
     "frame 0: no camera: .*got: none of 'transform_matrix'"),
    ({'frames': [{'file_path': 'a.png', 'transform_matrix': [[1, 0], 2]}]},
     r'got: transform_matrix of \[\[1, 0\], 2\]: expected rows of numbers'),
    ({'frames': [{'file_path': 'a.png', 'transform_matrix': np.ones((3, 4)).tolist()}]},
     'frame 0: no rotation'),
    ({'frames': [{'file_path': 'a.png', 'transform_matrix': [
        [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [3, 4, 5, 1]]}]},
     'frame 0: no camera: .*last row, got .3.0, 4.0, 5.0, 1.0.; is it transposed'),
    ({'frames': [{'file_path': 'a.png', 'transform_matrix': [
        [1, 0, 0, float('nan')], [0, 1, 0, 0], [0, 0, 1, 0]]}]},
     'frame 0: no position: expected finite numbers, got .nan')])
def test_transforms_that_cannot_be_used_are_refused_by_what_is_wrong(change, expected, tmp_path):
    path = tmp_path / 'transforms.json'
    path.write_text(json.dumps({**transforms(rig()), **change}))
    with pytest.raises(DataError, match=expected):
        read_transforms(path)


def test_the_folder_in_which_colmap_numbers_its_models_has_the_cameras_of_the_first(tmp_path):
    shutil.copytree(COLMAP / 'binary', tmp_path / 'sparse/0')
    read = read_cameras(tmp_path / 'sparse', [])
    assert len(read.entries) == len(read_colmap(COLMAP / 'binary').entries)


def test_a_colmap_model_whose_lines_lack_a_number_is_refused(tmp_path):
    for name in ('cameras.txt', 'images.txt'):
        (tmp_path / name).write_text((COLMAP / 'text' / name).read_text())
    lines = (tmp_path / 'images.txt').read_text().replace('0.4337614669220507 ', '')
    (tmp_path / 'images.txt').write_text(lines)
    with pytest.raises(DataError, match='a pose of 6 numbers in the line .3 0.55'):
        read_colmap(tmp_path)


def test_a_colmap_model_that_is_cut_off_is_refused(tmp_path):
    for name in ('cameras.bin', 'images.bin'):
        (tmp_path / name).write_bytes((COLMAP / 'binary' / name).read_bytes())
    (tmp_path / 'images.bin').write_bytes((COLMAP / 'binary/images.bin').read_bytes()[:-20])
    with pytest.raises(DataError, match='no COLMAP model: expected cameras and images'):
        read_colmap(tmp_path)
    (tmp_path / 'images.bin').write_bytes((COLMAP / 'binary/images.bin').read_bytes())
    (tmp_path / 'cameras.bin').write_bytes(
        struct.pack('<QiiQQ5d', 1, 7, 7, 10, 10, 9, 9, 5, 5, 0.1))
    with pytest.raises(DataError, match='FOV: run `colmap image_undistorter` first'):
        read_colmap(tmp_path)


@pytest.mark.parametrize(('name', 'content', 'expected'), [
    ('cameras.yml', '%YAML:1.0\n---\na: 1\n', 'no lens: expected camera_matrix'),
    ('cameras.yaml', '%YAML:1.0\n---\ncamera_matrix: [1, 2, 3]\n', 'expected matrices and lists'),
    ('cameras.txt', 'nothing', 'no COLMAP model'),
    ('cameras.csv', 'nothing', r'no cameras: expected transforms.json')])
def test_a_file_without_cameras_is_refused(name, content, expected, photos, tmp_path):
    (tmp_path / name).write_text(content)
    with pytest.raises(DataError, match=expected):
        read_cameras(tmp_path / name, photos)


@pytest.mark.parametrize('name', ['nothere.json', 'sparse/0'])
def test_cameras_that_are_not_there_are_refused_as_missing(name, photos, tmp_path):
    with pytest.raises(DataError, match=f'^{tmp_path / name}: no such file or folder: expected '
                                        'transforms.json'):
        read_cameras(tmp_path / name, photos)
    with pytest.raises(DataError, match=f'^{tmp_path}: no cameras: expected transforms.json'):
        read_cameras(tmp_path, photos)


def test_poses_that_do_not_match_the_photos_are_refused(photos, tmp_path):
    path = write_opencv(tmp_path / 'cameras.yml', rig(count=3), named=False)
    with pytest.raises(DataError, match='expected .* six numbers for each of 4 photos, got 3'):
        read_cameras(path, photos)
    path.write_text(re.sub(r'rows: 3\n( +)cols: 6', r'sizes: [ 18 ]', path.read_text()))
    with pytest.raises(DataError, match='expected .* six numbers for each of 4 photos, got 18'):
        read_cameras(path, photos)


@pytest.mark.parametrize(('name', 'missing'), [
    ('camera_matrix', 'cols: -3'), ('distortion_coefficients', '')])
def test_a_matrix_without_a_size_is_refused_before_opencv_reads_it(name, missing, tmp_path):
    path = write_opencv(tmp_path / 'cameras.yml', rig())
    head, tail = path.read_text().split(f'{name}:', 1)
    path.write_text(f'{head}{name}:' + re.sub(r'cols: \d', missing, tail, count=1))
    reading = ('import sys; from pathlib import Path; '
               'from active_recon.photos.opencv_yaml import read_opencv; '
               'read_opencv(Path(sys.argv[1]), [])')  # where it may end another process
    ended = subprocess.run([sys.executable, '-c', reading, path], capture_output=True, text=True,
                           check=False)
    assert 'expected rows and cols, 0 or more, of each matrix' in ended.stderr
    assert name in ended.stderr.splitlines()[-1]


def test_an_angle_of_view_that_no_lens_has_is_refused(tmp_path):
    path = tmp_path / 'transforms.json'
    path.write_text(json.dumps({'camera_angle_x': 3.3, 'frames': transforms(rig())['frames']}))
    with pytest.raises(DataError, match='camera_angle_x of 3.3: expected radians from 0 to pi'):
        read_transforms(path)


def test_a_lens_that_is_not_finite_is_refused(photos, tmp_path):
    path = write_opencv(tmp_path / 'cameras.yml', rig(), True)
    path.write_text(path.read_text().replace('300.', '.Nan', 1))
    with pytest.raises(DataError, match='no lens: expected camera_matrix'):
        read_cameras(path, photos)


def test_a_file_of_windows_is_read_and_one_that_is_no_text_is_not_printed(photos, tmp_path):
    path = write_transforms(tmp_path / 'transforms.json', rig())
    path.write_text(path.read_text(), encoding='utf-8-sig')
    assert_same(path, photos, rig())
    path.write_bytes(b'\xff\xfe' + bytes(range(256)) * 99)
    with pytest.raises(DataError, match='expected JSON with a list `frames`') as refused:
        read_transforms(path)
    assert len(str(refused.value)) < 400


def of_two_folders(root, first='left', second='right'):
    """Write cameras of photos that have the same names in two folders; return the second's."""
    photos = open_photos(photo_paths(blank_photos(root / second, rig())))[0]
    own, other = rig(), rig(distance=2.5)
    frames = [{**frame, 'file_path': f'{folder}/{name}'}
              for folder, cameras in ((first, other), (second, own))
              for name, frame in zip(names(cameras), transforms(cameras)['frames'], strict=True)]
    path = root / 'transforms.json'
    path.write_text(json.dumps({**transforms(own), 'frames': frames}))
    return photos, path


def test_of_cameras_of_one_name_the_photo_s_folder_tells_its_own(tmp_path):
    photos, path = of_two_folders(tmp_path)
    assert_same(path, photos, rig())


def test_names_that_differ_by_capitals_only_are_told_apart(tmp_path):
    cameras = rig(count=2)
    folder = blank_photos(tmp_path / 'photos', cameras)
    paths = [(folder / name).rename(folder / new)
             for name, new in zip(names(cameras), ['a.png', 'A.png'], strict=True)]
    file = tmp_path / 'transforms.json'
    frames = [{**frame, 'file_path': f'./photos/{path.name}'}
              for path, frame in zip(paths, transforms(cameras)['frames'], strict=True)]
    file.write_text(json.dumps({**transforms(cameras), 'frames': frames}))
    posed, left_out = posed_photos(read_cameras(file, []), open_photos(paths)[0])
    assert not left_out and [each.photo.path for each in posed] == paths
    for each, camera in zip(posed, cameras, strict=True):
        np.testing.assert_allclose(each.pose, camera.pose, atol=1e-9)


def test_photos_that_several_cameras_may_have_taken_are_left_out(tmp_path):
    photos, path = of_two_folders(tmp_path, 'a', 'b')
    moved = [replace(photo, path=tmp_path / photo.name) for photo in photos]
    with pytest.raises(DataError, match='2 cameras of that name in .*a/photo0.png and b/photo0'):
        posed_photos(read_cameras(path, moved), moved)


def test_photos_of_a_test_folder_have_the_cameras_of_its_file(tmp_path):
    (tmp_path / 'test').mkdir()
    for part in ('train', 'test'):
        (tmp_path / f'transforms_{part}.json').touch()
    assert find_cameras([tmp_path / 'test', tmp_path]) == tmp_path / 'transforms_test.json'
    assert find_cameras([tmp_path]) == tmp_path / 'transforms_train.json'


@pytest.mark.parametrize('about', ['(x y z)', '(1 1 1)\n(0 0 0)'])
def test_a_readme_without_a_box_is_no_reason_to_stop(about, photos, tmp_path):
    (tmp_path / 'README.txt').write_text(f'{about}\n(min max mean)\n')
    path = write_middlebury(tmp_path / 'it_par.txt', rig(PINHOLE))
    assert read_cameras(path, photos).box is None
