"""A video around an object is as good as photos: its sharpest frames are taken for them."""

import re
from types import SimpleNamespace

from active_recon.capture.sources import frame_count
from active_recon.errors import ConfigError, DataError
from active_recon.photos.files import photo_paths
from active_recon.photos.options import FRAMES, Options
from active_recon.photos.reconstruct import from_files
from active_recon.photos.sources import BoardCameras, SfmCameras, TurntableCameras
from active_recon.photos.video_frames import frames_of, is_video, sharpness
from command_line import command, refusal
import cv2
from films import film, SIZE
import numpy as np
from PIL import Image
import pytest
from rendered_boards import BOARD


@pytest.fixture(scope='module')
def checkered():
    """Return a sharp image, (H, W, 3), and a blurred one of the same."""
    down, across = np.mgrid[:SIZE[1], :SIZE[0]]
    sharp = np.repeat((((down // 8 + across // 8) % 2) * 200)[..., None], 3, -1).astype(np.uint8)
    return sharp, cv2.GaussianBlur(sharp, (0, 0), 3)


def written(path, images, rate=25.0):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), rate, SIZE)
    for image in images:
        writer.write(image[..., ::-1])
    writer.release()
    return path


def names(path, count):
    with frames_of(path, count) as folder:
        return [each.name for each in photo_paths(folder)]


def test_of_each_part_the_sharpest_frame_is_taken_and_the_copies_go(checkered, tmp_path):
    sharp, blurred = checkered
    path = written(tmp_path / 'walk.avi', [sharp if number in (2, 5, 9) else blurred
                                           for number in range(12)])
    assert sharpness(sharp) > 2 * sharpness(blurred)
    with frames_of(path, 3) as folder:
        found = sorted(folder.iterdir())
        assert [each.name for each in found] == [
            'walk-00002.png', 'walk-00005.png', 'walk-00009.png']
        np.testing.assert_allclose(np.asarray(Image.open(found[0])), sharp, atol=60)
        assert np.abs(np.asarray(Image.open(found[0]), float) - sharp).mean() < 4
    assert not folder.exists()


@pytest.mark.parametrize('count', [1, 5, 8, 36])
def test_there_are_as_many_frames_as_asked_for_or_all_of_a_shorter_video(count, tmp_path):
    assert len(names(film(tmp_path / '.short.avi'), count)) == min(count, 8)


@pytest.mark.parametrize('told', [1, 3, 500])
def test_a_video_whose_header_tells_another_number_of_frames_is_used(told, tmp_path, monkeypatch):
    path = film(tmp_path / 'film.avi')
    monkeypatch.setattr('active_recon.photos.video_frames.frame_count', lambda path: told)
    assert 1 <= len(names(path, 3)) <= 3


@pytest.fixture
def noisy(tmp_path):
    """Return a video of 12 images that fill kilobytes each."""
    rng = np.random.default_rng(0)
    return written(tmp_path / 'noisy.avi', [rng.integers(0, 255, (SIZE[1], SIZE[0], 3), np.uint8)
                                            for _ in range(12)])


def test_frames_after_a_damaged_one_are_used(noisy):
    stored = bytearray(noisy.read_bytes())
    frames = [found.start() for found in re.finditer(b'00dc', stored)]
    stored[frames[5] + 8:frames[5] + 300] = bytes(292)
    noisy.write_bytes(stored)
    assert len(names(noisy, 12)) == 11


def test_a_video_that_is_cut_off_is_told_of(noisy):
    def warnings():
        said = []
        with frames_of(noisy, 12, warn=said.append):
            return said

    assert not warnings()
    stored = noisy.read_bytes()
    noisy.write_bytes(stored[:len(stored) // 2])
    [said] = warnings()
    assert re.fullmatch(r'noisy.avi: only [56] of 12 frames can be read: is the video whole\?',
                        said)


def test_frames_are_counted_where_the_header_does_not_tell(tmp_path, monkeypatch):
    path, opened = film(tmp_path / 'film.avi'), cv2.VideoCapture
    assert frame_count(path) == 8

    def silent(*given):
        capture = opened(*given)
        return SimpleNamespace(get=lambda what: -1.0, grab=capture.grab, release=capture.release)

    monkeypatch.setattr('cv2.VideoCapture', silent)
    assert frame_count(path) == 8


def test_a_file_that_is_no_photo_is_a_video_and_a_folder_is_none(tmp_path):
    photo = tmp_path / 'photo.JPG'
    photo.touch()
    assert is_video(film(tmp_path / 'film.avi'))
    assert not is_video(photo) and not is_video(tmp_path) and not is_video([photo])
    assert not is_video(tmp_path / 'missing.mp4')


def test_a_file_that_is_neither_is_refused(tmp_path):
    path = tmp_path / 'photos.zip'
    path.write_bytes(b'PK' + bytes(100))
    with pytest.raises(DataError, match='neither a folder of photos nor a video'):
        from_files(path, SfmCameras())


@pytest.mark.parametrize('source', [None, 'cameras.json', TurntableCameras(0.1, 0.3, 1.0)])
def test_cameras_that_are_told_do_not_fit_a_video(source, tmp_path):
    with pytest.raises(ConfigError, match='--board or --sfm'):
        from_files(film(tmp_path / 'film.avi'), source)


def test_masks_do_not_fit_a_video(tmp_path):
    with pytest.raises(ConfigError, match='masks with a video'):
        from_files(film(tmp_path / 'film.avi'), SfmCameras(), Options(masks=tmp_path))


def test_what_is_wrong_with_a_video_is_said_in_a_line(tmp_path, monkeypatch, capsys):
    def refused(*arguments):
        return refusal(monkeypatch, capsys, 'reconstruct', *arguments)

    path = film(tmp_path / 'film.avi')
    assert '--board or --sfm' in refused(path)
    assert '--frames without a video' in refused(tmp_path, '--frames', 9)
    assert 'no such folder' in refused(path, '--watch', '--board')


def test_the_frames_are_the_photos_in_which_the_board_is_searched(tmp_path):
    path = film(tmp_path / 'film.avi')
    with pytest.raises(DataError, match='in 0 of 4 photos'):
        from_files(path, BoardCameras(BOARD), Options(frames=4))


def test_the_help_tells_how_many_frames_are_taken(monkeypatch, capsys):
    assert command(monkeypatch, 'reconstruct', '--help') == 0
    shown = re.sub(r'[\s\u2502]+', ' ', capsys.readouterr().out)
    assert f'default: {FRAMES}' in shown
