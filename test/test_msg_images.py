"""Images, masks and latents between ROS and numpy."""

import array

from active_recon.errors import MessageError
from msg_tools.images import (
    ENCODINGS,
    image_from_msg,
    image_size_from_msg,
    image_to_msg,
    latent_from_msg,
    latent_to_msg,
    mask_from_msg,
    mask_to_msg,
)
import numpy as np
import pytest
from sensor_msgs.msg import Image
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


def encoded(image, encoding, bigendian):
    """Return an RGB image's pixels as an encoding has them, opaque where it has an alpha."""
    if encoding == 'mono8':
        return image[..., :1]
    if encoding == '32FC3':
        return (image / 255).astype('>f4' if bigendian else '<f4')
    pixels = image if encoding.startswith('rgb') else image[..., ::-1]
    opaque = np.full(image.shape[:2], 255, np.uint8)
    return np.dstack([pixels, opaque]) if encoding.endswith('a8') else pixels


RAW = {'bayer_rggb8': 'rggb', 'bayer_bggr8': 'bggr', 'bayer_gbrg8': 'gbrg',
       'bayer_grbg8': 'grbg'}
YUV = {'yuv422': (1, 0), 'uyvy': (1, 0), 'yuv422_yuy2': (0, 1), 'yuyv': (0, 1)}
"""Where the first of two bytes with the brightness is, and with the colours."""


def smooth(rng, height, width):
    """Return an image whose colours change by as good as nothing from pixel to pixel."""
    low, high = rng.uniform(0, 255, (2, 3))
    across, down = np.linspace(0, 1, width), np.linspace(0, 1, height)[:, None]
    share = (across + down)[..., None] / 2
    return np.rint(low + share * (high - low)).astype(np.uint8)


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('encoding', RAW)
def test_a_raw_sensor_s_image_has_the_colors_that_the_sensor_saw(encoding, seed):
    image = smooth(np.random.default_rng(seed), 121, 200)
    raw = np.zeros(image.shape[:2], np.uint8)
    for place, color in enumerate(RAW[encoding]):
        row, column = divmod(place, 2)
        raw[row::2, column::2] = image[row::2, column::2, 'rgb'.index(color)]
    found = image_from_msg(message(raw, encoding, padding=seed)).astype(int)
    assert np.abs(found - image).max() <= 4


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('encoding', YUV)
def test_an_image_of_brightness_and_shared_colors_comes_back_nearly_as_it_was(encoding, seed):
    image = smooth(np.random.default_rng(seed), 50, 200)
    # ITU-R BT.601, of studio range: Y in [16, 235], U and V in [16, 240]
    red, green, blue = np.moveaxis(image / 255, -1, 0)
    y = 65.481 * red + 128.553 * green + 24.966 * blue + 16
    u = 128 - 37.797 * red - 74.203 * green + 112 * blue
    v = 128 + 112 * red - 93.786 * green - 18.214 * blue
    bright, color = YUV[encoding]
    packed = np.zeros((*image.shape[:2], 2))
    packed[..., bright] = y
    packed[:, 0::2, color], packed[:, 1::2, color] = u[:, 0::2], v[:, 0::2]
    found = image_from_msg(message(np.rint(packed).astype(np.uint8), encoding, padding=seed))
    assert np.abs(found.astype(int) - image).max() <= 4


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('bigendian', [False, True])
@pytest.mark.parametrize('encoding', sorted({*ENCODINGS} - {*RAW, *YUV}))
def test_every_encoding_says_the_same_in_any_size_row_length_and_byte_order(
        encoding, bigendian, seed):
    rng = np.random.default_rng(seed)
    height, width = rng.integers(1, 50, 2) if seed else (1, 1)
    image = rng.integers(0, 256, (height, width, 3), np.uint8)
    if encoding == 'mono8':
        image[..., 1:] = image[..., :1]
    msg = message(encoded(image, encoding, bigendian), encoding, int(rng.integers(0, 9)))
    msg.is_bigendian = int(bigendian)
    np.testing.assert_array_equal(image_from_msg(msg), image)
    assert image_size_from_msg(msg) == image.shape[:2]


@pytest.mark.parametrize('padding', [0, 5])
def test_an_image_of_rgb8_is_the_message_s_own_memory(padding):
    msg = message(RGB, 'rgb8', padding)
    assert np.shares_memory(image_from_msg(msg), np.frombuffer(msg.data, np.uint8))


def test_an_image_that_is_a_window_of_another_comes_back_as_it_was():
    window = np.arange(600, dtype=np.uint8).reshape(10, 20, 3)[2:7, 5:11, ::-1]
    np.testing.assert_array_equal(image_from_msg(image_to_msg(window, Header())), window)


@pytest.mark.parametrize('encoding', ['rgba8', 'bgra8'])
def test_an_image_of_any_alpha_is_mixed_with_white_and_rounded(encoding):
    color, alpha = np.random.default_rng(1).integers(0, 256, (2, 256, 256, 3), np.uint8)
    color[:, :, 0], alpha[:, :, 0] = np.indices((256, 256))  # each value under each alpha
    alpha = alpha[..., :1]
    mixed = (2 * (color * alpha.astype(int) + 255 * (255 - alpha.astype(int))) + 255) // 510
    pixels = color if encoding == 'rgba8' else color[..., ::-1]
    np.testing.assert_array_equal(
        image_from_msg(message(np.dstack([pixels, alpha]), encoding)), mixed)


def test_what_is_transparent_becomes_white():
    pixels = np.dstack([RGB, np.zeros(RGB.shape[:2], np.uint8)])
    assert (image_from_msg(message(pixels, 'rgba8')) == 255).all()


def short(msg):
    msg.data = msg.data[:-1]
    return msg


FLOAT = np.full((2, 2, 3), 0.5, np.float32)


@pytest.mark.parametrize(('msg', 'kind', 'said'), [
    (Image(encoding='rgb8', width=2**32 - 1, height=2**32 - 1, step=2**32 - 1), 'image_bytes',
     'at least 12884901885 bytes.*step of 4294967295'),
    (Image(encoding='rgb8'), 'image_size', 'above 0, got 0 x 0'),
    (message(RGB, 'yuv9'), 'encoding', "one of rgb8.*got 'yuv9'"),
    (short(message(RGB, 'rgb8')), 'image_bytes', 'expected 72 bytes.*got 71'),
    (message(RGB[..., :1], 'rgb8'), 'image_bytes', 'at least 18 bytes.*step of 6'),
    (message(RGB[:, :5, :2], 'yuyv'), 'image_size', 'even one for yuyv, got 5'),
    (message(RGB[:2, :, :1], 'bayer_rggb8'), 'image_size', '3 pixels a side.*got 6 x 2'),
    (message(FLOAT * np.nan, '32FC3'), 'image_values', r'in \[0, 1\], got nan to nan'),
    (message(FLOAT * 4, '32FC3'), 'image_values', 'got 2.0 to 2.0'),
    (message(-FLOAT, '32FC3'), 'image_values', 'got -0.5 to -0.5')])
def test_what_is_no_image_is_refused_in_plain_words(msg, kind, said):
    with pytest.raises(MessageError, match=said) as caught:
        image_from_msg(msg)
    assert caught.value.kind == kind
    if kind == 'image_values':  # the pixels are unread
        assert image_size_from_msg(msg) == (2, 2)
    else:
        with pytest.raises(MessageError, match=said):
            image_size_from_msg(msg)


@pytest.mark.parametrize('padding', [0, 3])
def test_a_mask_comes_back_as_it_was_whatever_its_object_is_painted_with(padding):
    mask = np.random.default_rng(1).random((4, 6)) < 0.5
    msg = mask_to_msg(mask, Header(frame_id='camera'))
    assert (msg.encoding, msg.header.frame_id) == ('mono8', 'camera')
    np.testing.assert_array_equal(mask_from_msg(msg), mask)
    painted = message(mask[..., None] * np.uint8(1), '8UC1', padding)
    np.testing.assert_array_equal(mask_from_msg(painted), mask)


def test_a_mask_of_colors_is_refused():
    with pytest.raises(MessageError, match="expected mono8 or 8UC1, got 'rgb8'") as error:
        mask_from_msg(image_to_msg(RGB, Header()))
    assert error.value.kind == 'mask'


def test_a_latent_comes_back_as_it_was():
    latent = np.random.default_rng(1).normal(size=(5, 3, 4)).astype(np.float32)
    msg = latent_to_msg(latent, Header())
    assert (msg.encoding, msg.height, msg.width) == ('32FC5', 3, 4)
    np.testing.assert_array_equal(latent_from_msg(msg), latent)


def test_a_latent_that_is_none_is_refused():
    with pytest.raises(MessageError, match="32FC<channels>, got 'rgb8'"):
        latent_from_msg(message(RGB, 'rgb8'))
    with pytest.raises(MessageError, match='latent not finite'):
        latent_from_msg(message(FLOAT * np.nan, '32FC3'))
