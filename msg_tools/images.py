"""Camera images and latents to and from sensor_msgs/Image."""

import array
from io import BytesIO
import re
from typing import Any

from active_recon.errors import MessageError
import numpy as np
from numpy.typing import NDArray
import PIL.Image
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

_BYTE: np.dtype[Any] = np.dtype(np.uint8)
_FLOAT: np.dtype[Any] = np.dtype(np.float32)
ENCODINGS = {'rgb8': (_BYTE, 3), 'bgr8': (_BYTE, 3), 'rgba8': (_BYTE, 4), 'bgra8': (_BYTE, 4),
             'mono8': (_BYTE, 1), '32FC3': (_FLOAT, 3)}

MOST_PIXELS = 1 << 26
"""Compressed images of more are refused: a small file may claim any size."""


def image_from_msg(msg: Image) -> NDArray[np.uint8]:
    """
    Return a camera's image, (height, width, 3) uint8 RGB.

    Reads rgb8, bgr8, mono8, rgba8 and bgra8 (what is transparent becomes white), and 32FC3, RGB in
    [0, 1]. Raises MessageError on another encoding, an image of no size, one with fewer bytes
    than its size asks for, and values of 32FC3 that are NaN or out of range.
    """
    if msg.encoding not in ENCODINGS:
        raise MessageError(f'expected an image encoded as one of {", ".join(ENCODINGS)}, '
                           f'got {msg.encoding!r}', 'encoding')
    dtype, channels = ENCODINGS[msg.encoding]
    pixels = _pixels(msg, dtype, channels)
    if msg.encoding == '32FC3':
        return _from_float(pixels)
    if channels == 1:
        return np.repeat(pixels, 3, axis=2)
    color = pixels[..., 2::-1] if msg.encoding.startswith('bgr') else pixels[..., :3]
    return _over_white(color, pixels[..., 3:]) if channels == 4 else np.ascontiguousarray(color)


def compressed_image_from_msg(msg: CompressedImage) -> NDArray[np.uint8]:
    """
    Return a camera's image, (height, width, 3) uint8 RGB; what is transparent becomes white.

    Reads JPEG and PNG. Raises MessageError on anything else, and on images of more than
    `MOST_PIXELS` before they are unpacked.
    """
    try:
        with PIL.Image.open(BytesIO(msg.data), formats=('JPEG', 'PNG')) as image:
            if image.width * image.height > MOST_PIXELS:
                raise MessageError(f'expected an image of at most {MOST_PIXELS} pixels, got '
                                   f'{image.height} x {image.width}', 'image_size')
            if image.has_transparency_data:
                pixels = np.asarray(image.convert('RGBA'))
                return _over_white(pixels[..., :3], pixels[..., 3:])
            return np.asarray(image.convert('RGB'))
    except (OSError, ValueError, SyntaxError, PIL.Image.DecompressionBombError,
            PIL.Image.DecompressionBombWarning) as error:
        raise MessageError('expected a compressed image as JPEG or PNG, got '
                           f'{msg.format!r}: {error}', 'encoding') from error


def image_to_msg(image: NDArray[np.uint8], header: Header) -> Image:
    """Return an RGB image, (height, width, 3) uint8, as rgb8."""
    return _image_msg(image, 'rgb8', header)


def latent_from_msg(msg: Image) -> NDArray[np.float32]:
    """Return a latent, (C, h, w) float32; raises MessageError where it is not a finite 32FC<C>."""
    encoding = re.fullmatch(r'32FC([1-9]\d*)', msg.encoding)
    if encoding is None:
        raise MessageError(f'expected a latent encoded as 32FC<channels>, got {msg.encoding!r}',
                           'encoding')
    latent = _pixels(msg, _FLOAT, int(encoding[1]))
    if not np.isfinite(latent).all():
        raise MessageError('expected a finite latent, got NaN or infinity', 'image_values')
    return np.ascontiguousarray(latent.transpose(2, 0, 1), np.float32)


def latent_to_msg(latent: NDArray[np.float32], header: Header) -> Image:
    """Return a latent, (C, h, w) float32, as an image of encoding 32FC<C>."""
    return _image_msg(latent.transpose(1, 2, 0), f'32FC{len(latent)}', header)


def _image_msg(pixels: NDArray[Any], encoding: str,
               header: Header) -> Image:
    height, width, channels = pixels.shape
    # An array.array is handed over in microseconds, any other sequence is copied byte by byte.
    data = array.array('B', np.ascontiguousarray(pixels).tobytes())
    return Image(header=header, height=height, width=width, encoding=encoding,
                 step=width * channels * pixels.itemsize, data=data)


def _pixels(msg: Image, dtype: np.dtype[Any], channels: int) -> NDArray[Any]:
    """Return the message's pixels, (height, width, channels), rows unpadded."""
    if msg.height == 0 or msg.width == 0:
        raise MessageError('expected an image with a height and a width above 0, '
                           f'got {msg.height} x {msg.width}', 'image_size')
    row = msg.width * channels * dtype.itemsize
    if msg.step < row:
        raise MessageError(f'expected rows of at least {row} bytes for {msg.width} pixels of '
                           f'{msg.encoding}, got a step of {msg.step}', 'image_bytes')
    expected = msg.step * msg.height
    if len(msg.data) < expected:
        raise MessageError(f'expected {expected} bytes for {msg.height} rows of {msg.step}, '
                           f'got {len(msg.data)}', 'image_bytes')
    rows = np.frombuffer(msg.data, np.uint8, expected).reshape(msg.height, msg.step)[:, :row]
    ordered = dtype.newbyteorder('>' if msg.is_bigendian else '<')
    return np.ascontiguousarray(rows).view(ordered).reshape(msg.height, msg.width, channels)


def _from_float(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    lowest, highest = pixels.min(), pixels.max()  # NaN where any value is
    if not (lowest >= 0 and highest <= 1):
        raise MessageError('expected values of 32FC3 in [0, 1], got '
                           f'{lowest} to {highest}', 'image_values')
    scaled: NDArray[np.uint8] = np.rint(pixels * np.float32(255)).astype(np.uint8)
    return scaled


def _over_white(color: NDArray[Any],
                alpha: NDArray[Any]) -> NDArray[np.uint8]:
    opacity = alpha.astype(np.float32) / 255
    mixed: NDArray[np.uint8] = np.rint(color * opacity + 255 * (1 - opacity)).astype(np.uint8)
    return mixed
