"""Devices, video files and folders as images: their pace, their faults, and how they come back."""

import os
import threading
import time

from active_recon.capture import grabber as grabbing
from active_recon.capture import sources
from active_recon.capture.grabber import Grabber
from active_recon.capture.sources import fitting_lens, FOLDER_RATE, open_source
from active_recon.cli.main import app
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import Intrinsics
from active_recon.parameters.camera import CameraParameters
import cv2
from films import film, shade, SIZE
import numpy as np
from PIL import Image
import pytest
from typer.testing import CliRunner
import yaml


def waited(condition, budget_s=20.0):
    deadline = time.monotonic() + budget_s
    while not (value := condition()):
        assert time.monotonic() < deadline, 'waited in vain'
        time.sleep(0.002)
    return value


class Grabs:
    """A grabber whose grabs are all kept."""

    def __init__(self, source, reopen=None, loop=False):
        self.all, self.made = [], threading.Event()
        self.grabber = Grabber(source, reopen or (lambda: source), loop, time.monotonic_ns,
                               self.keep)
        self.made.set()

    def keep(self):
        assert self.made.wait(20)
        self.all.extend(self.grabber.take())

    @property
    def images(self):
        return [each.image for each in self.all if each.image is not None]

    @property
    def problems(self):
        return [str(each.problem) for each in self.all if each.problem is not None]

    def until_end(self):
        waited(lambda: self.all and self.all[-1].image is None and not self.all[-1].problem)
        self.grabber.close()


class Fake:
    """A device that gives so many images and then is gone."""

    def __init__(self, count, size=(4, 3)):
        self.name, self.size, self.rate = 'fake', size, None
        self.left, self.closed = count, False

    def read(self):
        if not self.left:
            raise DataError('fake: no image comes any more', 'device')
        self.left -= 1
        return np.zeros((3, 4, 3), np.uint8)

    def close(self):
        self.closed = True


def test_every_image_of_a_film_comes_in_order_at_its_rate(tmp_path):
    source = open_source(str(film(tmp_path / 'film.avi')))
    assert source.size == SIZE and source.rate == pytest.approx(50)
    grabs = Grabs(source)
    grabs.until_end()
    assert len(grabs.images) == 8
    for number, image in enumerate(grabs.images):
        red, green, blue = image.reshape(-1, 3).mean(axis=0)
        assert red == pytest.approx(shade(number), abs=6) and max(green, blue) < 12
    stamps = [each.stamp for each in grabs.all[:-1]]
    assert stamps[-1] - stamps[0] > 0.7 * 7 / 50 * 1e9  # not as fast as it can be read


def test_a_film_that_loops_begins_again(tmp_path):
    path = str(film(tmp_path / 'film.avi', rate=400.0))
    grabs = Grabs(open_source(path), lambda: open_source(path), loop=True)
    waited(lambda: len(grabs.images) > 20)
    grabs.grabber.close()
    shades = [image[..., 0].mean() for image in grabs.images]
    assert shades[8] < 10 and shades[15] > 245 and shades[16] < 10


def test_a_folder_comes_by_its_numbers_and_what_cannot_be_read_is_left_out(tmp_path):
    for number in (10, 2, 1):
        Image.new('RGB', SIZE, (number, 0, 0)).save(tmp_path / f'{number}.png')
    Image.new('RGB', (5, 5)).save(tmp_path / '3.png')
    (tmp_path / '4.png').write_bytes(b'nothing')
    source = open_source(str(tmp_path))
    assert source.rate == FOLDER_RATE
    grabs = Grabs(open_source(str(tmp_path), rate=300))
    grabs.until_end()
    assert [image[0, 0, 0] for image in grabs.images] == [1, 2, 10]
    small, broken = grabs.problems
    assert '3.png: another size: expected 64 x 48' in small
    assert '4.png: not readable' in broken


@pytest.mark.parametrize('mode', ['RGBA', 'LA'])
def test_a_transparent_image_of_a_folder_lies_on_white(mode, tmp_path):
    pixels = np.zeros((*SIZE[::-1], 4), np.uint8)
    pixels[10:20, :, :3] = 60
    pixels[10:20, 8:40, 3], pixels[10:20, 40:, 3] = 255, 102
    Image.fromarray(pixels).convert(mode).save(tmp_path / '1.png')
    image = open_source(str(tmp_path)).read()
    assert (image[0] == 255).all() and (image[15, :8] == 255).all()
    assert (image[15, 8:40] == 60).all() and (image[15, 40:] == 177).all()


def test_a_size_is_asked_of_a_device_alone(tmp_path):
    Image.new('RGB', SIZE).save(tmp_path / '1.png')
    for place in (tmp_path, film(tmp_path / 'film.avi')):
        with pytest.raises(ConfigError, match='no device, so no size .* got 1280 x 720; files'):
            open_source(str(place), 1280, 720)


def test_a_folder_whose_first_image_cannot_be_read_begins_with_the_others(tmp_path):
    (tmp_path / '0.png').write_bytes(b'no image')
    with pytest.raises(DataError, match='0.png: not readable'):
        open_source(str(tmp_path))
    Image.new('RGB', SIZE).save(tmp_path / '1.png')
    source = open_source(str(tmp_path))
    assert source.size == SIZE
    with pytest.raises(DataError, match='0.png: not readable'):
        source.read()
    assert source.read() is not None and source.read() is None


def test_a_device_that_was_unplugged_is_searched_for_and_goes_on(monkeypatch):
    monkeypatch.setattr(grabbing, 'RETRY_S', 0.01)
    first, second = Fake(2), Fake(3)
    again = iter([DataError('fake: no such device', 'device'),
                  DataError('calibration for another size', 'image_size'), second])

    def reopen():
        found = next(again)
        if isinstance(found, DataError):
            raise found
        return found

    grabs = Grabs(first, reopen)
    waited(lambda: len(grabs.images) == 5)
    assert first.closed
    told = [each for each in grabs.all if each.problem]
    assert all(each.lasting for each in told) and len(told) >= 3
    assert [each.problem.kind for each in told[:3]] == ['device', 'device', 'image_size']
    grabs.grabber.close()
    assert second.closed


def test_a_device_that_stays_away_is_searched_for_once_a_second(monkeypatch):
    monkeypatch.setattr(grabbing, 'RETRY_S', 0.1)
    tried = []

    def reopen():
        tried.append(1)
        raise DataError('calibration for another size', 'image_size')

    grabs = Grabs(Fake(0), reopen)
    time.sleep(0.55)
    grabs.grabber.close()
    assert 1 <= len(tried) <= 6


def test_of_images_that_nobody_takes_the_last_few_are_kept():
    source = Fake(50)
    grabber = Grabber(source, lambda: source, False, time.monotonic_ns, lambda: None)
    waited(lambda: not source.left)
    grabber.close()
    assert len(grabber.take()) <= 4 and not grabber.take()


@pytest.fixture
def device(tmp_path, monkeypatch):
    """Return a device file, and what is asked of it."""
    asked = {}

    class Capture:
        def __init__(self, place, backend):
            asked['place'] = place

        def set(self, key, value):
            asked[key] = value

        def isOpened(self):  # noqa: N802
            return True

        def read(self):
            return True, np.full((480, 640), 7, np.uint8)

        def release(self):
            asked['released'] = True

    monkeypatch.setattr(sources, '_DEVICE', str(tmp_path / 'video'))
    monkeypatch.setattr(cv2, 'VideoCapture', Capture)
    (tmp_path / 'video3').touch()
    return asked


def test_a_device_is_asked_for_its_size_and_gives_colours_at_its_own_pace(device, tmp_path):
    source = open_source('3', 1280, 720, 15)
    assert device['place'] == str(tmp_path / 'video3')
    assert (device[cv2.CAP_PROP_FRAME_WIDTH], device[cv2.CAP_PROP_FRAME_HEIGHT],
            device[cv2.CAP_PROP_FPS]) == (1280, 720, 15)
    assert source.rate is None and source.size == (640, 480)  # what it really gives
    assert source.read().shape == (480, 640, 3)
    source.close()
    assert device['released']
    with pytest.raises(DataError, match='video4: no such device: .*there are: .*video3'):
        open_source(str(tmp_path / 'video4'))


def test_a_device_is_one_by_any_of_its_names(device, tmp_path):
    name = tmp_path / 'by-id'
    name.symlink_to('/dev/null')  # a character device, as those of cameras are
    source = open_source(str(name), 1280, 720)
    assert device['place'] == source.name == str(name) and source.rate is None


def test_what_cannot_be_opened_is_told_in_one_line(tmp_path, capfd):
    (tmp_path / 'film.mp4').write_bytes(b'no film at all')
    for place, words in (
            (str(tmp_path / 'film.mp4'), 'film.mp4: no image comes: expected a working camera'),
            (str(tmp_path / 'none.mp4'), 'no such file, folder or device')):
        with pytest.raises(DataError, match=words) as raised:
            open_source(place)
        assert '\n' not in str(raised.value)
    with pytest.raises(DataError, match='no images: expected some'):
        (tmp_path / 'empty').mkdir()
        open_source(str(tmp_path / 'empty'))
    with pytest.raises(ConfigError, match='no source: expected a video device'):
        open_source('')
    assert capfd.readouterr().err == ''  # nothing of the libraries' own


def test_the_command_hands_its_options_to_the_node_as_they_are(monkeypatch):
    begun = []
    monkeypatch.setattr(os, 'execv', lambda program, words: begun.append(words))
    done = CliRunner().invoke(app, ['camera', '0', '--size', '1280x720', '--frame', "it's",
                                    '--loop', '--camera-info', 'my lens.yaml', '-r', '__ns:=/b'])
    assert done.exit_code == 0, done.output
    words, = begun
    given = dict(word.split(':=', 1) for word in words if ':=' in word)
    assert given.pop('__ns') == '/b'
    read = {name: yaml.safe_load(value) for name, value in given.items()}
    expected = CameraParameters(source='0', camera_info='my lens.yaml', camera_frame="it's",
                                width=1280, height=720, loop=True)
    assert read == {name: getattr(expected, name) for name in read}
    assert all(type(value) is type(getattr(expected, name)) for name, value in read.items())
    CliRunner().invoke(app, ['camera', '📷/a "b".mp4'])
    (source,) = (word for word in begun[1] if word.startswith('source:='))
    assert '📷' in source and yaml.safe_load(source.removeprefix('source:=')) == '📷/a "b".mp4'


@pytest.mark.parametrize('size', ['large', '640', '640x', '0x0', '640x0', '0x480'])
def test_a_size_that_is_none_is_refused_by_the_command(monkeypatch, size):
    monkeypatch.setattr(os, 'execv', lambda *_: pytest.fail('the node was begun'))
    wrong = CliRunner().invoke(app, ['camera', '0', '--size', size])
    assert f'expected WIDTHxHEIGHT above 0, e.g. 1280x720, got {size!r}' in str(wrong.exception)


def test_a_calibration_for_another_size_is_refused():
    lens = Intrinsics(500, 500, 320, 240, 640, 480)
    assert fitting_lens(lens, (640, 480), 'it.yaml') is lens
    with pytest.raises(DataError, match='it.yaml: calibration for another size: expected 1280 x '
                                        '720 pixels, as the images are, got 640 x 480'):
        fitting_lens(lens, (1280, 720), 'it.yaml')
