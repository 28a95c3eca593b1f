"""Photos are read upright, in 8 bits, and no larger than needed; what is no photo is left out."""

import shutil
import subprocess
import sys

from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Camera, Intrinsics, orbit_camera
from active_recon.photos.camera_file import PosedPhoto
from active_recon.photos.files import (
    in_order_of,
    LARGEST_SIDE,
    open_photos,
    photo_paths,
    read_photo,
)
from active_recon.photos.large_images import opened as opened_large
from active_recon.photos.views import load_view, load_views, view_of
from active_recon.watching.arrivals import Arrivals
import cv2
import numpy as np
from PIL import ExifTags, Image, ImageOps
import pytest


def drawn(width=40, height=30):
    """Return an image no two corners of which are alike, (H, W, 3) uint8."""
    image = np.zeros((height, width, 3), np.uint8)
    image[..., 0] = np.linspace(0, 255, width)
    image[..., 1] = np.linspace(0, 255, height)[:, None]
    image[:5, :5, 2] = 255
    return image


def opened(path):
    return open_photos([path])[0][0]


@pytest.mark.parametrize('orientation', range(1, 9))
def test_a_photo_is_turned_as_exif_says(orientation, tmp_path):
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    path = tmp_path / 'photo.png'
    Image.fromarray(drawn()).save(path, exif=exif)
    with Image.open(path) as image:
        expected = np.asarray(ImageOps.exif_transpose(image))
    photo = opened(path)
    np.testing.assert_array_equal(read_photo(photo), expected)
    assert photo.upright_size == expected.shape[1::-1]
    np.testing.assert_array_equal(read_photo(photo, upright=False), drawn())


def test_the_lens_decides_whether_a_photo_is_taken_as_stored(tmp_path):
    from active_recon.photos.camera_file import CameraFile, Entry, posed_photos, sized
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    Image.fromarray(drawn()).save(tmp_path / 'photo.png', exif=exif)
    photo = opened(tmp_path / 'photo.png')
    for width, height, upright in ((30, 40, True), (40, 30, False)):
        lens = sized(Intrinsics(50, 50, width / 2, height / 2, width, height))
        posed, _ = posed_photos(CameraFile('it', [Entry('photo', np.eye(4), lens)]), [photo])
        assert posed[0].upright is upright
        assert load_views(posed)[0][0].image.shape == (height, width, 3)


@pytest.mark.parametrize('orientation', [3, 6, 8])
def test_cameras_of_colmap_are_of_photos_as_stored_and_tell_what_was_up_when_they_were_taken(
        orientation, tmp_path):
    from active_recon.photos.camera_file import CameraFile, Entry, posed_photos, sized
    square = drawn()[:30, :30]
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    Image.fromarray(square).save(tmp_path / 'photo.png', exif=exif)
    photo = opened(tmp_path / 'photo.png')
    # As the camera is held the photo has to be turned by EXIF: down and right of what is seen
    rows, columns = (ImageOps.exif_transpose(_with_orientation(Image.fromarray(
        each.astype(np.uint8)), orientation)) for each in np.mgrid[:30, :30])
    right = np.array([int(np.asarray(each)[5, 6]) - int(np.asarray(each)[5, 5])
                      for each in (columns, rows)])
    down = np.array([int(np.asarray(each)[6, 5]) - int(np.asarray(each)[5, 5])
                     for each in (columns, rows)])
    pose = orbit_camera(0.7, 0.4).pose
    lens = sized(Intrinsics(50, 50, 15, 15, 30, 30))
    for stored in (True, False):
        [posed], _ = posed_photos(CameraFile('it', [Entry('photo', pose, lens)], stored=stored),
                                  [photo])
        assert posed.upright is not stored
        expected = pose[:3, :2] @ np.column_stack([right, down]) if stored else pose[:3, :2]
        np.testing.assert_allclose(posed.as_seen[:3, :2], expected, atol=1e-12)
        np.testing.assert_array_equal(posed.as_seen[:, 2:], pose[:, 2:])


def _with_orientation(image, orientation):
    image.getexif()[ExifTags.Base.Orientation] = orientation
    return image


@pytest.mark.parametrize('orientation', [1, 3, 6, 8])
def test_masks_and_depth_of_a_photo_as_it_is_seen_fit_it_as_it_is_stored(orientation, tmp_path):
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    Image.fromarray(drawn()).save(tmp_path / 'photo.png', exif=exif)
    photo = opened(tmp_path / 'photo.png')
    stored = drawn()[..., 0] > 90
    Image.fromarray(stored).save(tmp_path / 'stored.png', exif=exif)
    with Image.open(tmp_path / 'stored.png') as image:
        seen = np.array(ImageOps.exif_transpose(image))
    (tmp_path / 'masks').mkdir()
    Image.fromarray(seen).save(tmp_path / 'masks' / 'photo.png')
    cv2.imwrite(str(tmp_path / 'photo_depth.png'), seen.astype(np.uint16) * 500)
    posed = PosedPhoto(photo, orbit_camera(0).pose, Intrinsics(50, 50, 20, 15, 40, 30), False)
    view = load_view(posed, tmp_path / 'masks')
    np.testing.assert_array_equal(view.mask, stored)
    np.testing.assert_array_equal(view.depth, stored * np.float32(0.5))
    if orientation in (6, 8):  # only the photo as stored has this shape
        Image.fromarray(stored).save(tmp_path / 'masks' / 'photo.png')
        np.testing.assert_array_equal(load_view(posed, tmp_path / 'masks').mask, stored)


@pytest.mark.parametrize('ending', ['png', 'tif'])
@pytest.mark.parametrize('channels', [1, 3])
def test_sixteen_bits_become_eight(ending, channels, tmp_path):
    deep = (np.arange(12 * channels) * 1800).astype(np.uint16).reshape(3, 4, channels)
    path = tmp_path / f'deep.{ending}'
    assert cv2.imwrite(str(path), deep[..., ::-1])  # OpenCV's order is blue, green, red
    expected = np.broadcast_to(deep / 257, (3, 4, 3))
    np.testing.assert_allclose(read_photo(opened(path)), expected, atol=1)


def taken_at(path, when):
    exif = Image.Exif()
    if when:
        exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.DateTimeOriginal] = when
    Image.fromarray(drawn()).save(path, exif=exif)


def test_photos_are_in_the_order_of_their_names_or_of_their_times(tmp_path):
    for name, when in (('a', '2026:11:02 10:00:00'), ('b', '2026:11:01 23:59:59'),
                       ('c', '2026:11:02 09:00:00')):
        taken_at(tmp_path / f'{name}.jpg', when)
    photos = [opened(path) for path in photo_paths(tmp_path)]
    assert [each.path.stem for each in in_order_of('name', photos)] == ['a', 'b', 'c']
    assert [each.path.stem for each in in_order_of('time', photos)] == ['b', 'c', 'a']
    with pytest.raises(ConfigError, match='order: unknown value: expected one of name, time'):
        in_order_of('size', photos)
    taken_at(tmp_path / 'd.jpg', '')
    with pytest.raises(DataError, match='d.jpg: no time: expected when it was taken in EXIF'):
        in_order_of('time', [*photos, opened(tmp_path / 'd.jpg')])


@pytest.mark.parametrize('mode', ['L', 'P', 'CMYK', '1', 'LA'])
def test_a_photo_of_any_mode_becomes_rgb(mode, tmp_path):
    path = tmp_path / ('photo.tif' if mode == 'CMYK' else 'photo.png')
    Image.fromarray(drawn()).convert(mode).save(path)
    assert read_photo(opened(path)).shape == (30, 40, 4 if mode == 'LA' else 3)


def test_a_hundred_megapixels_are_reduced_and_their_lens_with_them(tmp_path):
    path = tmp_path / 'huge.png'
    Image.new('L', (10_000, 10_000), 77).save(path, compress_level=1)
    photo = opened(path)
    lens = Intrinsics(9000, 9000, 5000, 5000, 10_000, 10_000)
    views, left_out = load_views([PosedPhoto(photo, orbit_camera(0).pose, lens)])
    assert not left_out
    side = views[0].image.shape[0]
    assert side <= LARGEST_SIDE and (views[0].image == 77).all()
    assert views[0].camera.intrinsics.fx == pytest.approx(0.9 * side)


@pytest.mark.parametrize('ending', ['png', 'tif'])
def test_a_photo_beyond_the_limit_of_pillow_is_read_and_the_limit_stays(
        ending, tmp_path, monkeypatch):
    path = tmp_path / f'photo.{ending}'
    Image.fromarray(drawn()).save(path)
    monkeypatch.setattr(Image, 'MAX_IMAGE_PIXELS', 100)
    assert read_photo(opened(path)).shape == (30, 40, 3)
    assert Image.MAX_IMAGE_PIXELS == 100
    with pytest.raises(DataError, match='30 x 40|40 x 30'), opened_large(path, most_pixels=1199):
        pass


def test_the_same_photo_twice_is_used_once(tmp_path):
    for name in ('a.png', 'b.png'):
        Image.fromarray(drawn()).save(tmp_path / name)
    (tmp_path / 'c.jpg').write_bytes(b'no photo')
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert [photo.name for photo in photos] == ['a.png']
    assert left_out[0] == 'b.png: the same photo as a.png'
    assert left_out[1].startswith('c.jpg: not readable: expected a whole image')


def test_the_same_photo_from_two_folders_or_named_twice_is_used_once(tmp_path):
    paths = [tmp_path / folder / 'a.png' for folder in ('one', 'two')]
    for path in paths:
        path.parent.mkdir()
        Image.fromarray(drawn()).save(path)
    photos, left_out = open_photos([*paths, paths[0]])
    assert [photo.path for photo in photos] == paths[:1]
    assert left_out == [f'a.png: the same photo as {paths[0]}'] * 2


def test_photos_are_in_the_order_of_their_numbers(tmp_path):
    for name in ('img10.png', 'img2.png', 'notes.txt'):
        (tmp_path / name).touch()
    assert [path.name for path in photo_paths(tmp_path)] == ['img2.png', 'img10.png']


def test_a_folder_without_a_photo_is_refused(tmp_path):
    with pytest.raises(DataError, match='no photos: expected files of'):
        photo_paths(tmp_path)
    with pytest.raises(DataError, match='no such folder'):
        photo_paths(tmp_path / 'none')
    (tmp_path / 'photo.txt').touch()
    with pytest.raises(DataError, match='photo.txt: a file: expected a folder with photos'):
        photo_paths(tmp_path / 'photo.txt')
    (tmp_path / 'broken.png').write_bytes(b'\x89PNG')
    with pytest.raises(DataError, match='no readable photo: expected at least one, got none; '
                                        'broken.png'):
        open_photos(photo_paths(tmp_path))


def test_a_folder_whose_folders_have_the_photos_names_them(tmp_path):
    for name in ('train_2/r_0.png', 'train_10/r_0.png', '.thumbnails/r_0.png', 'sparse/0.bin'):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).touch()
    with pytest.raises(DataError, match='found none; give one of its folders that have some: '
                                        'train_2, train_10$'):
        photo_paths(tmp_path)


def test_a_folder_whose_files_are_no_photos_names_one(tmp_path):
    for name in ('.DS_Store', 'IMG_10.MOV', 'IMG_2.MOV'):
        (tmp_path / name).touch()
    with pytest.raises(DataError, match='found none, but 2 others, such as IMG_2.MOV$'):
        photo_paths(tmp_path)


def test_hidden_files_and_depth_are_no_photos_and_raw_ones_are_told_of(tmp_path):
    Image.fromarray(drawn()).save(tmp_path / 'a.png')
    for name in ('.trashed-1-a.png', '._a.png', '~a.png', 'a_depth.png', 'a.DNG', 'b.DNG'):
        shutil.copy(tmp_path / 'a.png', tmp_path / name)
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert [photo.name for photo in photos] == ['a.png']
    assert len(left_out) == 1 and left_out[0].startswith('b.DNG: not readable: ')
    assert 'a raw photo: convert it to JPEG' in left_out[0]
    arrivals = Arrivals(tmp_path)
    arrivals.arrived(0.0)
    assert {path.name for path in arrivals.arrived(1.0)} == {'a.png', 'b.DNG'}
    for name in ('a.png', 'a.DNG'):
        (tmp_path / name).unlink()
    with pytest.raises(DataError, match=r'no readable photo: .*; b.DNG: not readable: .* raw'):
        open_photos(photo_paths(tmp_path))


def test_of_a_damaged_photo_nothing_is_said_but_why_it_is_left_out(tmp_path):
    (tmp_path / 'a.tif').write_bytes(b'II*\0' + np.random.default_rng(0).bytes(500))
    code = ('from pathlib import Path\nfrom active_recon.photos.files import open_photo\n'
            f'try: open_photo(Path({str(tmp_path / "a.tif")!r}), {{}})\n'
            'except Exception as error: print(error)')
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith('a.tif: not readable') and done.stdout.count('\n') == 1
    assert not done.stderr


def test_a_truncated_photo_is_left_out_by_its_name(tmp_path):
    path = tmp_path / 'cut.png'
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (90, 90, 3), np.uint8)).save(path)
    path.write_bytes(path.read_bytes()[:9000])
    lens = Intrinsics(90, 90, 45, 45, 90, 90)
    with pytest.raises(DataError, match='no photo can be used: cut.png: not readable'):
        load_views([PosedPhoto(opened(path), orbit_camera(0).pose, lens)])


@pytest.mark.parametrize(('tag', 'value', 'expected'), [
    (ExifTags.Base.FocalLengthIn35mmFilm, 50, 50 / 43.2666 * 50), (None, None, None)])
def test_exif_gives_a_first_focal_length(tag, value, expected, tmp_path):
    exif = Image.Exif()
    if tag:
        exif.get_ifd(ExifTags.IFD.Exif)[tag] = value
    Image.fromarray(drawn()).save(tmp_path / 'photo.jpg', exif=exif)
    found = opened(tmp_path / 'photo.jpg').focal
    assert found == (None if expected is None else pytest.approx(expected, rel=1e-4))


def test_the_focal_length_of_a_photo_that_was_made_smaller_is_smaller(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif).update({
        ExifTags.Base.FocalLength: 24.0, ExifTags.Base.FocalPlaneXResolution: 5000.0,
        ExifTags.Base.FocalPlaneResolutionUnit: 2, ExifTags.Base.ExifImageWidth: 4000,
        ExifTags.Base.ExifImageHeight: 3000})
    for side, by in ((40, 100), (400, 10)):
        Image.new('RGB', (side, 3 * side // 4)).save(tmp_path / 'photo.jpg', exif=exif)
        assert opened(tmp_path / 'photo.jpg').focal == pytest.approx(24 * 5000 / 25.4 / by)


def test_alpha_is_a_mask_only_where_something_is_see_through():
    lens = Intrinsics(50, 50, 20, 15, 40, 30)
    camera = Camera(orbit_camera(0).pose, lens)
    opaque = np.dstack([drawn(), np.full((30, 40), 255, np.uint8)])
    assert view_of('opaque', opaque, camera).mask is None
    half = opaque.copy()
    half[:, :20, 3] = 0
    np.testing.assert_array_equal(view_of('half', half, camera).mask, half[..., 3] > 0)
    with pytest.raises(DataError, match='empty: expected an object in its alpha channel'):
        view_of('none', opaque * np.uint8([1, 1, 1, 0]), camera)
    with pytest.raises(DataError, match='wrong image: expected 30 x 40 x 3 or 4 uint8'):
        view_of('small', opaque[:20], camera)


def test_masks_are_found_by_the_photo_s_name_and_scaled(tmp_path):
    Image.fromarray(drawn()).save(tmp_path / 'a.jpg')
    posed = [PosedPhoto(opened(tmp_path / 'a.jpg'), orbit_camera(0).pose,
                        Intrinsics(50, 50, 20, 15, 40, 30))]
    mask = np.zeros((60, 80), np.uint8)
    mask[20:40, 20:60] = 255
    for number, name in enumerate(('a.png', 'a.jpg.png', 'A.PNG')):
        folder = tmp_path / f'masks{number}'
        folder.mkdir()
        Image.fromarray(mask).save(folder / name)
        view = load_views(posed, folder)[0][0]
        assert view.mask_source == 'masks'
        np.testing.assert_array_equal(view.mask, mask[::2, ::2] > 0)
    Image.fromarray(mask[:, :30]).save(tmp_path / 'masks0/a.png')
    with pytest.raises(DataError, match='no mask of the right size: expected 40 x 30'):
        load_views(posed, tmp_path / 'masks0')
    with pytest.raises(DataError, match=r'a\.jpg: .*masks0/a\.png: no mask of the right size'):
        load_view(posed[0], tmp_path / 'masks0')
    (tmp_path / 'none').mkdir()
    assert load_view(posed[0], tmp_path / 'none').mask is None
    with pytest.raises(DataError, match='masks of other photos: expected some named like a.jpg'):
        load_views(posed, tmp_path / 'none')
