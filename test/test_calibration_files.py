"""What a calibration reads beside its images: their order, angles and poses."""

import math
import unicodedata

from active_recon.calibration.files import image_paths, read_angles, read_image, read_poses
from active_recon.errors import DataError
import cv2
import numpy as np
import pytest

NAMES = ['a2.png', 'a10.png']


def write(path, text):
    path.write_text(text)
    return path


def test_images_come_in_the_order_of_their_numbers(tmp_path):
    for name in ('view10.png', 'view9.JPG', 'view1.png', 'notes.txt', '._view2.png'):
        (tmp_path / name).touch()
    assert [path.name for path in image_paths([tmp_path])] == [
        'view1.png', 'view9.JPG', 'view10.png']


def test_folders_without_images_and_names_twice_are_refused(tmp_path):
    with pytest.raises(DataError, match='no images: .* found none'):
        image_paths([tmp_path])
    for folder in ('a', 'b'):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / '1.png').touch()
    with pytest.raises(DataError, match='got 1.png twice'):
        image_paths([tmp_path / 'a', tmp_path / 'b'])


def test_a_place_that_does_not_exist_is_refused_as_that(tmp_path):
    with pytest.raises(DataError, match='imgaes: no such file or folder: expected images'):
        image_paths([tmp_path, tmp_path / 'imgaes'])


def test_a_file_that_is_no_image_is_refused_by_name(tmp_path):
    (tmp_path / 'no.png').write_bytes(b'nothing')
    for path in (tmp_path / 'no.png', tmp_path / 'nowhere.png'):
        with pytest.raises(DataError, match=f'{path.name}: not readable: expected an image'):
            read_image(path)


def test_an_image_is_read_as_the_camera_took_it_whatever_exif_says(tmp_path):
    from PIL import Image
    exif = Image.Exif()
    exif[0x0112] = 6  # to be shown turned by a quarter
    Image.new('RGB', (40, 20)).save(tmp_path / 'a.jpg', exif=exif)
    assert cv2.imread(str(tmp_path / 'a.jpg')).shape == (40, 20, 3)
    assert read_image(tmp_path / 'a.jpg').shape == (20, 40, 3)


@pytest.mark.parametrize('text', [
    'image,degrees\na10.png, 90\na2.png, 45\n', 'a2.png,45\na10.png,90\nother.png,1\n',
    '45\n90\n', 'degrees\n45\n\n90\n', 'images/a2.png,45\nimages/a10.png,90', '\ufeff45\n90\n'],
    ids=['heading', 'more than asked', 'without names', 'heading alone', 'with folders',
         'by a spreadsheet'])
def test_angles_belong_to_their_images(tmp_path, text):
    angles = read_angles(write(tmp_path / 'angles.csv', text), NAMES)
    assert angles == pytest.approx({'a2.png': math.pi / 4, 'a10.png': math.pi / 2})


def test_an_umlaut_of_two_characters_is_that_of_one(tmp_path):
    written, stored = (unicodedata.normalize(form, 'Schüssel.png') for form in ('NFC', 'NFD'))
    assert read_angles(write(tmp_path / 'angles.csv', f'{written},180\n'),
                       [stored]) == {stored: math.pi}


@pytest.mark.parametrize(('text', 'said'), [
    ('a2.png,45\n', 'none for a10.png'),
    ('45\n', 'rows do not match the images: .* each of the 2 images, .* got 1'),
    ('a2.png,45\n90\n', 'rows that begin with their names'),
    ('a2.png,45\na10.png,ninety\n', r'line 2: wrong row: expected a number, .* got a10.png, '
                                    r'ninety'),
    ('a2.png,45\na10.png,inf\n', 'line 2'),
    ('a2.png,45\na10.png,90\nother/a2.png,40', 'line 3: a second row for a2.png'),
    ('a2.png,45,3\na10.png,90,3\n', 'line 1'),
    ('', 'none for a2.png, a10.png'),
])
def test_angles_that_do_not_tell_every_image_s_are_refused(tmp_path, text, said):
    with pytest.raises(DataError, match=said):
        read_angles(write(tmp_path / 'angles.csv', text), NAMES)


def test_a_pose_is_read_as_position_and_quaternion(tmp_path):
    half = math.sqrt(0.5)
    path = write(tmp_path / 'poses.csv', 'image,x,y,z,qx,qy,qz,qw\n'
                 f'a10.png,1,2,3,0,0,{half},{half}\na2.png,0,0,0,0,0,0,1\n')
    poses = read_poses(path, NAMES)
    np.testing.assert_allclose(poses['a2.png'], np.eye(4))
    np.testing.assert_allclose(poses['a10.png'] @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)


def test_a_quaternion_that_is_no_unit_is_refused(tmp_path):
    path = write(tmp_path / 'poses.csv', '0,0,0,0,0,0,1\n0,0,0,0,0,1,1\n')
    with pytest.raises(DataError, match='unit quaternion of a10.png'):
        read_poses(path, NAMES)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match='nowhere.csv: not readable: expected a CSV file'):
        read_angles(tmp_path / 'nowhere.csv', NAMES)


def test_digits_that_are_no_number_are_letters(tmp_path):
    for name in ('1²1.png', '2.png'):
        cv2.imwrite(str(tmp_path / name), np.zeros((2, 2, 3), np.uint8))
    assert len(image_paths([tmp_path])) == 2


@pytest.mark.parametrize(('ending', 'share'), [('jpg', 0.0), ('jpg', 0.5), ('png', 0.5)])
def test_an_image_that_is_cut_off_is_refused_not_filled_with_grey(ending, share, tmp_path):
    path = tmp_path / f'cut.{ending}'
    noise = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    cv2.imwrite(str(path), noise)
    assert read_image(path).shape == noise.shape
    whole = path.read_bytes()
    path.write_bytes(whole[:int(share * len(whole))])
    with pytest.raises(DataError, match='cut.*: not readable: expected an image file, whole'):
        read_image(path)
