"""Photos that find their cameras by a board, and those of a turntable."""

import math
import os

from active_recon.calibration.board import Board
from active_recon.calibration.lens import write_lens
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import orbit_camera
from active_recon.photos.board_photos import seen_board
from active_recon.photos.files import is_photo, LARGEST_SIDE, open_photos, photo_paths
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_files
from active_recon.photos.sources import BoardCameras, posed_by, TurntableCameras
import numpy as np
from photo_rigs import blank_photos, PINHOLE, rig
from PIL import ExifTags, Image
import pytest
from rendered_boards import BOARD, LENS, render


@pytest.fixture(scope='module')
def board_poses():
    """Return the poses of cameras around the board, world from optical, at various tilts."""
    middle = np.array([BOARD.columns, -BOARD.rows, 0]) * BOARD.square / 2
    found = []
    for number in range(5):
        pose = orbit_camera(number * 1.3, 0.7 + 0.12 * (number % 4), 0.5).pose.copy()
        pose[:3, 3] += middle
        found.append(pose)
    return found


@pytest.fixture(scope='module')
def photos(board_poses, tmp_path_factory):
    folder = tmp_path_factory.mktemp('board')
    face_up = np.diag([1.0, -1, -1, 1])
    for number, pose in enumerate(board_poses):
        image = render(LENS, np.linalg.inv(pose) @ face_up)
        Image.fromarray(image).save(folder / f'{number}.png')
    Image.fromarray(np.full((480, 640, 3), 99, np.uint8)).save(folder / '9.png')
    return open_photos(photo_paths(folder))[0]


def test_each_photo_finds_its_camera_by_the_board(photos, board_poses):
    file, posed, left_out = posed_by(BoardCameras(BOARD), photos)
    assert left_out == ['9.png: no board seen in it']
    for own, true in zip(posed, board_poses, strict=True):
        assert np.linalg.norm(own.pose[:3, 3] - true[:3, 3]) < 0.004
        turn = own.pose[:3, :3].T @ true[:3, :3]
        assert math.acos(min(1, (np.trace(turn) - 1) / 2)) < math.radians(0.7)
        assert own.intrinsics.fx == pytest.approx(LENS.fx, rel=0.01)
    assert file.up is not None and file.up[2] == 1


def test_a_board_that_is_hardly_seen_is_refused(photos):
    with pytest.raises(DataError, match='board: seen in 2 of 3 photos: expected it in 3 or more'):
        posed_by(BoardCameras(BOARD), [*photos[:2], photos[-1]])


def test_where_all_photos_show_the_board_but_are_too_few_the_error_asks_for_more(photos):
    with pytest.raises(DataError, match='seen in 2 of 2 photos: .* take more, or give the lens'):
        posed_by(BoardCameras(BOARD), photos[:2])


def test_a_board_that_is_in_no_photo_is_refused(photos):
    with pytest.raises(DataError, match='board: seen in 0 of 1 photos') as raised:
        posed_by(BoardCameras(BOARD), photos[-1:])
    assert '9 x 7 squares' in str(raised.value) and '\n' not in str(raised.value)


def test_photos_of_another_board_are_left_out_and_say_which(photos):
    smaller = Board(columns=5, rows=4, square=0.03, marker=0.0225)
    with pytest.raises(DataError, match='board: seen in 0 of 2 photos'):
        posed_by(BoardCameras(smaller), photos[:2])
    with pytest.raises(DataError, match='0.png: another board: expected one of 5 x 4 squares'):
        seen_board(photos[0], smaller)


def test_photos_of_another_size_are_left_out_as_of_another_lens(photos, tmp_path):
    with Image.open(photos[3].path) as image:
        image.resize((960, 720)).save(tmp_path / 'large.png')
    large = open_photos([tmp_path / 'large.png'])[0]
    _, posed, left_out = posed_by(BoardCameras(BOARD), [*photos[:4], *large])
    assert len(posed) == 4
    assert left_out == ['large.png: another size: expected 640 x 480 pixels of one lens, got '
                        '960 x 720']


def test_photos_that_were_zoomed_are_left_out_as_of_another_lens(photos, tmp_path):
    for number, photo in enumerate(photos[:5]):
        exif = Image.Exif()
        exif[ExifTags.Base.Orientation] = 1
        if number:
            exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = (
                (39, 40, 52, 39)[number - 1])  # rounded differently, and zoomed
        with Image.open(photo.path) as image:
            image.save(tmp_path / photo.name, exif=exif)
    _, posed, left_out = posed_by(BoardCameras(BOARD), open_photos(photo_paths(tmp_path))[0])
    assert [each.photo.name for each in posed] == ['0.png', '1.png', '2.png', '4.png']
    assert left_out == ['3.png: another zoom: expected a focal length of 39 mm (35 mm '
                        'equivalent), as others have by EXIF, got 52']


def test_a_lens_from_a_file_needs_a_single_photo_and_fits_a_reduced_one(photos, tmp_path):
    write_lens(LENS.resized(4 * LENS.width, 4 * LENS.height), tmp_path / 'lens.yaml')
    with Image.open(photos[0].path) as image:
        image.resize((4 * LENS.width, 4 * LENS.height)).save(tmp_path / 'large.png')
    large = open_photos([tmp_path / 'large.png'])[0]
    _, posed, _ = posed_by(BoardCameras(BOARD, tmp_path / 'lens.yaml'), large)
    assert posed[0].intrinsics.width <= LARGEST_SIDE < 4 * LENS.width
    _, at_once, _ = posed_by(BoardCameras(BOARD), photos[:-1])
    assert np.linalg.norm(posed[0].pose[:3, 3] - at_once[0].pose[:3, 3]) < 0.01


def test_a_turntable_s_steps_are_azimuths_the_other_way_round(tmp_path):
    photos = open_photos(photo_paths(blank_photos(tmp_path, rig(PINHOLE))))[0]
    source = TurntableCameras(math.radians(15), math.radians(20), 0.6, math.radians(50))
    _, posed, _ = posed_by(source, photos)
    for number, each in enumerate(posed):
        position = each.pose[:3, 3]
        assert math.atan2(position[1], position[0]) == pytest.approx(math.radians(-15 * number))
        assert np.linalg.norm(position) == pytest.approx(0.6)
        assert each.intrinsics.fx == pytest.approx(160 / math.tan(math.radians(25)))
    with pytest.raises(DataError, match='photo0.png: no focal length: .* --fov-deg'):
        posed_by(TurntableCameras(0.2, 0.3, 0.6), photos)
    for step, view in ((0, 1), (0.2, 4)):
        with pytest.raises(ConfigError, match='expected'):
            posed_by(TurntableCameras(step, 0.3, 0.6, view), photos)
    with pytest.raises(ConfigError, match='axes: without a file of cameras'):
        posed_by(source, photos, 'opengl')


def test_the_table_has_turned_to_photos_that_cannot_be_read_too(tmp_path):
    blank_photos(tmp_path, rig(PINHOLE, count=5))
    (tmp_path / 'photo2.png').write_bytes(b'damaged')
    (tmp_path / 'photo1.heic').write_bytes(b'what photo1.png was made from')
    photos, left_out = open_photos(photo_paths(tmp_path))
    _, posed, _ = posed_by(TurntableCameras(0.3, 0.2, 0.6, 0.9), photos)
    assert len(left_out) == 2
    azimuths = [math.atan2(*each.pose[[1, 0], 3]) for each in posed]
    np.testing.assert_allclose(azimuths, [0, -0.3, -0.9, -1.2])


def test_a_folder_that_is_called_as_a_photo_is_none(tmp_path):
    blank_photos(tmp_path, rig(PINHOLE, count=2))
    (tmp_path / 'masks.png').mkdir()
    assert not is_photo(tmp_path / 'masks.png')
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert [photo.name for photo in photos] == ['photo0.png', 'photo1.png'] and not left_out


def test_a_pipe_that_is_called_as_a_photo_is_none_and_a_link_to_nothing_is_told_of(tmp_path):
    blank_photos(tmp_path, rig(PINHOLE, count=2))
    os.mkfifo(tmp_path / 'pipe.png')
    (tmp_path / 'link.png').symlink_to('moved.png')
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert len(photos) == 2
    assert len(left_out) == 1 and left_out[0].startswith('link.png: not readable')


def test_by_time_the_place_of_a_photo_that_cannot_be_read_is_unknown(tmp_path):
    for number, name in enumerate(('IMG_9998', 'IMG_9999', 'IMG_0001', 'IMG_0002')):
        exif = Image.Exif()
        exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.DateTimeOriginal] = (
            f'2026:01:01 12:00:0{number}')
        Image.new('RGB', (40, 30), (number, 0, 0)).save(tmp_path / f'{name}.jpg', exif=exif)
    (tmp_path / 'IMG_0001.jpg').write_bytes(b'damaged')
    with pytest.raises(DataError, match='the place of a photo that is left out is unknown'):
        from_files(tmp_path, TurntableCameras(0.3, 0.2, 0.6, 0.9), Options(order='time'))


def test_a_turntable_s_photos_have_their_focal_length_by_exif(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = 28
    for number in range(2):
        image = Image.new('RGB', (300, 200), (90 * number, 0, 0))
        image.save(tmp_path / f'{number}.jpg', exif=exif)
    photos = open_photos(photo_paths(tmp_path))[0]
    _, posed, _ = posed_by(TurntableCameras(0.2, 0.3, 0.6), photos)
    expected = 28 / math.hypot(36, 24) * math.hypot(300, 200)
    assert posed[1].intrinsics.fx == pytest.approx(expected)


def test_photos_without_cameras_beside_them_are_refused_with_the_formats(tmp_path):
    photos = open_photos(photo_paths(blank_photos(tmp_path / 'a' / 'b', rig(PINHOLE))))[0]
    with pytest.raises(DataError, match=r'no cameras beside the photos: expected transforms.json'):
        posed_by(None, photos)
