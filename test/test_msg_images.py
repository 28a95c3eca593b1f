"""Images and latents between ROS and numpy."""

import array
from io import BytesIO
import struct
import sys
import zlib

from active_recon.errors import MessageError
from msg_tools.images import (
    compressed_image_from_msg,
    image_from_msg,
    image_to_msg,
    latent_from_msg,
    latent_to_msg,
)
import numpy as np
import PIL.Image
import pytest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

RGB = np.random.default_rng(0).integers(0, 256, (4, 6, 3), np.uint8)


def message(pixels, encoding, padding=0):
    rows = np.ascontiguousarray(pixels).reshape(len(pixels), -1).view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    return Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                 step=padded.shape[1], data=array.array('B', padded.tobytes()))


def test_an_image_comes_back_as_it_was():
    header = Header(frame_id='camera')
    msg = image_to_msg(RGB, header)
    assert (msg.encoding, msg.header, msg.step) == ('rgb8', header, 18)
    np.testing.assert_array_equal(image_from_msg(msg), RGB)


@pytest.mark.parametrize('padding', [0, 5])
@pytest.mark.parametrize('encoding', ['rgb8', 'bgr8', 'rgba8', 'bgra8', '32FC3'])
def test_every_color_encoding_says_the_same_with_and_without_padding(encoding, padding):
    pixels = RGB[..., ::-1] if encoding.startswith('bgr') else RGB
    if encoding.endswith('a8'):
        pixels = np.dstack([pixels, np.full(RGB.shape[:2], 255, np.uint8)])
    if encoding == '32FC3':
        pixels = (RGB / 255).astype(np.float32)
    np.testing.assert_array_equal(image_from_msg(message(pixels, encoding, padding)), RGB)


def test_mono_is_grey():
    image = image_from_msg(message(RGB[..., :1], 'mono8'))
    np.testing.assert_array_equal(image, RGB[..., [0, 0, 0]])


def test_what_is_transparent_becomes_white():
    pixels = np.dstack([RGB, np.zeros(RGB.shape[:2], np.uint8)])
    assert (image_from_msg(message(pixels, 'rgba8')) == 255).all()


def test_a_foreign_byte_order_is_read():
    pixels = (RGB / 255).astype('>f4' if sys.byteorder == 'little' else '<f4')
    msg = message(pixels, '32FC3')
    msg.is_bigendian = int(sys.byteorder == 'little')
    np.testing.assert_array_equal(image_from_msg(msg), RGB)


def short(msg):
    msg.data = msg.data[:-1]
    return msg


FLOAT = np.full((2, 2, 3), 0.5, np.float32)


@pytest.mark.parametrize(('msg', 'kind', 'said'), [
    (Image(encoding='rgb8'), 'image_size', 'above 0, got 0 x 0'),
    (message(RGB, 'yuv9'), 'encoding', "one of rgb8.*got 'yuv9'"),
    (short(message(RGB, 'rgb8')), 'image_bytes', 'expected 72 bytes.*got 71'),
    (message(RGB[..., :1], 'rgb8'), 'image_bytes', 'at least 18 bytes.*step of 6'),
    (message(FLOAT * np.nan, '32FC3'), 'image_values', r'in \[0, 1\], got nan to nan'),
    (message(FLOAT * 4, '32FC3'), 'image_values', 'got 2.0 to 2.0'),
    (message(-FLOAT, '32FC3'), 'image_values', 'got -0.5 to -0.5')])
def test_what_is_no_image_is_refused_in_plain_words(msg, kind, said):
    with pytest.raises(MessageError, match=said) as caught:
        image_from_msg(msg)
    assert caught.value.kind == kind


def test_a_latent_comes_back_as_it_was():
    latent = np.random.default_rng(1).normal(size=(5, 3, 4)).astype(np.float32)
    msg = latent_to_msg(latent, Header())
    assert (msg.encoding, msg.height, msg.width) == ('32FC5', 3, 4)
    np.testing.assert_array_equal(latent_from_msg(msg), latent)


def test_a_latent_that_is_none_is_refused():
    with pytest.raises(MessageError, match="32FC<channels>, got 'rgb8'"):
        latent_from_msg(message(RGB, 'rgb8'))
    with pytest.raises(MessageError, match='finite latent'):
        latent_from_msg(message(FLOAT * np.nan, '32FC3'))


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


@pytest.mark.parametrize('msg', [
    CompressedImage(), CompressedImage(format='png', data=b'hello'), claiming(9000, 9000),
    claiming(10_000, 10_000), claiming(100_000, 100_000), claiming(0, 5), packed(RGB, 'GIF'),
    CompressedImage(format='png', data=packed(RGB).data[:100])])
def test_what_is_no_compressed_image_is_refused(msg):
    with pytest.raises(MessageError, match='expected (a compressed|an) image'):
        compressed_image_from_msg(msg)
