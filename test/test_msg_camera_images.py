"""Camera images, raw or compressed: known by their size, unpacked when they are wanted."""

from io import BytesIO
import struct
import zlib

from active_recon.errors import MessageError
import cv2
from msg_tools.camera_images import (
    compressed_image_from_msg,
    pixels_from_msg,
    reduced_from_msg,
    size_from_msg,
)
from msg_tools.images import image_from_msg, image_to_msg
import numpy as np
import PIL.Image
import pytest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

RGB = np.random.default_rng(0).integers(0, 256, (4, 6, 3), np.uint8)


def packed(image, kind='PNG'):
    file = BytesIO()
    PIL.Image.fromarray(image).save(file, kind)
    return CompressedImage(format=kind.lower(), data=file.getvalue())


def test_a_compressed_image_is_the_image():
    image = np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8)
    assert np.array_equal(compressed_image_from_msg(packed(image)), image)
    smooth = np.full((16, 16, 3), (200, 100, 50), np.uint8)
    found = compressed_image_from_msg(packed(smooth, 'JPEG'))
    np.testing.assert_allclose(found.astype(int), smooth, atol=3)


def test_a_grey_or_transparent_compressed_image_is_rgb_over_white():
    grey = compressed_image_from_msg(packed(np.full((2, 3), 7, np.uint8)))
    assert np.array_equal(grey, np.full((2, 3, 3), 7))
    clear = compressed_image_from_msg(packed(np.zeros((2, 3, 4), np.uint8)))
    assert np.array_equal(clear, np.full((2, 3, 3), 255))


def claiming(width, height):
    """Return a PNG of one pixel that claims another size."""
    content = bytearray(packed(np.zeros((1, 1, 3), np.uint8)).data)
    content[16:24] = struct.pack('>II', width, height)
    content[29:33] = struct.pack('>I', zlib.crc32(content[12:29]))
    return CompressedImage(format='png', data=bytes(content))


def test_a_compressed_image_of_16_bits_is_that_of_its_upper_8():
    rng = np.random.default_rng(1)
    for shape in ((4, 6), (4, 6, 3)):
        deep = rng.integers(0, 1 << 16, shape, np.uint16)
        data = cv2.imencode('.png', deep)[1].tobytes()
        bgr = deep if deep.ndim == 3 else np.dstack([deep] * 3)
        np.testing.assert_array_equal(
            compressed_image_from_msg(CompressedImage(format='png', data=data)),
            bgr[..., ::-1] >> 8)


@pytest.mark.parametrize('kind', ['PNG', 'JPEG'])
@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
def test_a_compressed_bayer_pattern_has_the_colours_of_the_raw_one(pattern, kind):
    values = np.random.default_rng(0).integers(0, 256, (24, 32), np.uint8)
    msg = packed(values, kind)
    kept = np.asarray(PIL.Image.open(BytesIO(msg.data)))  # JPEG loses some
    raw = image_from_msg(Image(height=24, width=32, encoding=f'bayer_{pattern}8', step=32,
                               data=kept.tobytes()))
    msg.format = f'bayer_{pattern}8; {kind.lower()} compressed '
    np.testing.assert_array_equal(pixels_from_msg(msg), raw)
    np.testing.assert_array_equal(reduced_from_msg(msg, 2), raw)


def test_a_bayer_pattern_of_16_bits_has_the_colours_of_its_upper_8():
    values = np.random.default_rng(0).integers(0, 1 << 16, (24, 32), np.uint16)
    deep = CompressedImage(format='bayer_gbrg16; png compressed ',
                           data=cv2.imencode('.png', values)[1].tobytes())
    flat = packed((values >> 8).astype(np.uint8))
    flat.format = 'bayer_gbrg8; png compressed '
    np.testing.assert_array_equal(pixels_from_msg(deep), pixels_from_msg(flat))


def test_a_bayer_pattern_that_was_interpolated_before_it_was_compressed_stays():
    msg = packed(RGB)
    msg.format = 'bayer_rggb8; png compressed bgr8'
    np.testing.assert_array_equal(pixels_from_msg(msg), RGB)


@pytest.mark.parametrize('msg', [
    CompressedImage(), CompressedImage(format='png', data=b'hello'), claiming(9000, 9000),
    claiming(10_000, 10_000), claiming(100_000, 100_000), claiming(0, 5), packed(RGB, 'GIF'),
    CompressedImage(format='png', data=packed(RGB).data[:100])])
def test_what_is_no_compressed_image_is_refused(msg):
    with pytest.raises(MessageError, match='not readable|too large|empty image'):
        pixels_from_msg(msg)


@pytest.mark.parametrize(('msg', 'got'), [
    (CompressedImage(), "'': 0 bytes of neither"),
    (CompressedImage(format='h264', data=b'hello'), "'h264': 5 bytes of neither")])
def test_data_of_neither_format_are_refused_alike_each_time(msg, got):
    with pytest.raises(MessageError) as caught:
        size_from_msg(msg)
    assert str(caught.value) == (
        f'compressed image not readable: expected JPEG or PNG, got {got}')


def cut(msg, by):
    return CompressedImage(format=msg.format, data=bytes(msg.data)[:-by])


@pytest.mark.parametrize('by', [2, 100, 1000])
def test_a_jpeg_that_ends_early_is_refused_though_its_size_can_be_told(by):
    image = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    broken = cut(packed(image, 'JPEG'), by)
    assert size_from_msg(broken) == (60, 80)
    with pytest.raises(MessageError, match='compressed image not readable') as caught:
        pixels_from_msg(broken)
    assert caught.value.kind == 'encoding'


@pytest.mark.parametrize('make', [
    lambda image: image_to_msg(image, Header()), packed, lambda image: packed(image, 'JPEG')],
    ids=['raw', 'PNG', 'JPEG'])
@pytest.mark.parametrize('shape', [(1, 1, 3), (7, 300, 3), (64, 5, 3)])
def test_the_size_is_told_without_unpacking_and_is_that_of_the_pixels(make, shape):
    msg = make(np.random.default_rng(0).integers(0, 256, shape, np.uint8))
    assert size_from_msg(msg) == pixels_from_msg(msg).shape[:2] == shape[:2]


@pytest.mark.parametrize('quality', [30, 95])
def test_a_jpeg_has_the_pixels_that_another_reader_finds(quality):
    image = cv2.GaussianBlur(np.random.default_rng(0).integers(0, 256, (90, 70, 3), np.uint8),
                             (0, 0), 3)
    data = cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
    expected = np.asarray(PIL.Image.open(BytesIO(data)).convert('RGB'))
    found = compressed_image_from_msg(CompressedImage(format='jpeg', data=data))
    np.testing.assert_array_equal(found, expected)


def test_a_note_in_the_file_that_it_is_to_be_shown_upright_turns_no_pixel():
    file, exif = BytesIO(), PIL.Image.Exif()
    exif[0x0112] = 6  # turned by a quarter
    PIL.Image.fromarray(np.zeros((8, 16, 3), np.uint8)).save(file, 'JPEG', exif=exif)
    msg = CompressedImage(format='jpeg', data=file.getvalue())
    assert compressed_image_from_msg(msg).shape == (8, 16, 3)
