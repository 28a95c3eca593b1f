"""HEIC photos, an iPhone's default, are as good as JPEG where pillow-heif is installed."""

import sys

from active_recon.errors import DataError
from active_recon.photos.files import open_photos, photo_paths, read_photo
from active_recon.photos.formats import is_heic
import numpy as np
from PIL import ExifTags, Image
import pytest

ORIENTATION = ExifTags.Base.Orientation
WIDTH, HEIGHT = 96, 64


@pytest.fixture(scope='module')
def heif():
    library = pytest.importorskip('pillow_heif')
    library.register_heif_opener()


@pytest.fixture
def drawn():
    """Return an image no two corners of which are alike, (H, W, 3) uint8."""
    across, down = np.meshgrid(np.linspace(0, 255, WIDTH), np.linspace(0, 255, HEIGHT))
    return np.dstack([across, down, (across + down) / 2]).astype(np.uint8)


def written(path, image, orientation=1, suffix_of='heif'):
    exif = Image.Exif()
    exif[ORIENTATION] = orientation
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = 26
    Image.fromarray(image).save(path, suffix_of, exif=exif.tobytes(), quality=95)
    return path


@pytest.mark.usefixtures('heif')
@pytest.mark.parametrize('orientation', range(1, 9))
def test_a_heic_photo_is_read_as_a_jpeg_of_the_same_pixels_and_exif(
        orientation, drawn, tmp_path):
    [heic, jpeg], left_out = open_photos([
        written(tmp_path / 'a.HEIC', drawn, orientation),
        written(tmp_path / 'b.jpg', drawn, orientation, 'jpeg')])
    assert not left_out
    assert (heic.size, heic.orientation) == (jpeg.size, jpeg.orientation) == (
        (WIDTH, HEIGHT), orientation)
    assert heic.focal == jpeg.focal
    for upright in (True, False):
        pixels, expected = (read_photo(each, upright).astype(int) for each in (heic, jpeg))
        assert pixels.shape == expected.shape
        assert np.abs(pixels - expected).mean() < 3


@pytest.mark.usefixtures('heif')
def test_what_a_photo_is_is_told_by_its_content_not_by_its_name(drawn, tmp_path):
    written(tmp_path / 'a.jpg', drawn)
    written(tmp_path / 'b.heic', drawn[::-1].copy(), suffix_of='jpeg')
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert [photo.name for photo in photos] == ['a.jpg', 'b.heic'] and not left_out
    assert all(read_photo(photo).shape == (HEIGHT, WIDTH, 3) for photo in photos)


@pytest.mark.usefixtures('heif')
def test_heic_beside_the_jpeg_made_from_it_is_used_once(drawn, tmp_path):
    written(tmp_path / 'IMG_1.HEIC', drawn)
    written(tmp_path / 'IMG_1.jpg', drawn, suffix_of='jpeg')
    photos, left_out = open_photos(photo_paths(tmp_path))
    assert [photo.name for photo in photos] == ['IMG_1.jpg'] and not photos[0].lost
    assert left_out == ['IMG_1.HEIC: the same photo as IMG_1.jpg']


@pytest.mark.usefixtures('heif')
@pytest.mark.parametrize('share', [0.03, 0.3, 0.6, 0.95])
def test_a_heic_photo_that_is_cut_off_is_left_out_by_its_name(share, drawn, tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, drawn.shape, np.uint8)
    path = written(tmp_path / 'cut.heic', noise)
    whole = path.read_bytes()
    path.write_bytes(whole[:int(share * len(whole))])
    with pytest.raises(DataError, match='cut.heic: not readable: expected a whole image'):
        read_photo(open_photos([path])[0][0])


def test_without_pillow_heif_the_refusal_tells_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'pillow_heif', None)
    for name in ('a.HEIC', 'b.jpg'):
        (tmp_path / name).write_bytes(b'\0\0\0\x18ftypheic\0\0\0\0mif1heic' + bytes(40))
    for name in ('a.HEIC', 'b.jpg'):
        with pytest.raises(DataError, match=rf"{name}: .* HEIC, .* 'active_recon\[heic\]', or let "
                                            'the camera take JPEG'):
            open_photos([tmp_path / name])
    with pytest.raises(DataError) as raised:
        open_photos(photo_paths(tmp_path))
    assert 'a.HEIC' in str(raised.value) and str(raised.value).count('pip install') == 1


@pytest.mark.parametrize(('brands', 'expected'), [
    (b'heic\0\0\0\0mif1', True), (b'mif1\0\0\0\0heix', True), (b'mif1\0\0\0\0avif', False),
    (b'avif\0\0\0\0mif1', False), (b'mp42\0\0\0\0isom', False), (b'qt  \0\0\0\0qt  ', False)])
def test_heic_is_told_from_avif_and_from_films(brands, expected):
    assert is_heic(b'\0\0\0\x14ftyp' + brands + bytes(44)) is expected
