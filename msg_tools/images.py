"""Camera images, masks, depth and latents to and from sensor_msgs/Image."""

import array
import re
from typing import Any

from active_recon.errors import MessageError
from active_recon.volumes.depth_images import MM_PER_METRE
import cv2
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image
from std_msgs.msg import Header

_BYTE: np.dtype[Any] = np.dtype(np.uint8)
_FLOAT: np.dtype[Any] = np.dtype(np.float32)
ENCODINGS = {'rgb8': (_BYTE, 3), 'bgr8': (_BYTE, 3), 'rgba8': (_BYTE, 4), 'bgra8': (_BYTE, 4),
             'mono8': (_BYTE, 1), '8UC3': (_BYTE, 3), '32FC3': (_FLOAT, 3),
             'yuv422': (_BYTE, 2), 'uyvy': (_BYTE, 2), 'yuv422_yuy2': (_BYTE, 2),
             'yuyv': (_BYTE, 2), 'bayer_rggb8': (_BYTE, 1), 'bayer_bggr8': (_BYTE, 1),
             'bayer_gbrg8': (_BYTE, 1), 'bayer_grbg8': (_BYTE, 1)}
MASK_ENCODINGS = ('mono8', '8UC1')
DEPTH_ENCODINGS: dict[str, np.dtype[Any]] = {
    encoding: np.dtype(kind) for encoding, kind in (
        ('16UC1', np.uint16), ('mono16', np.uint16), ('32FC1', np.float32))}
_TO_RGB = {'bgr8': cv2.COLOR_BGR2RGB, '8UC3': cv2.COLOR_BGR2RGB, 'mono8': cv2.COLOR_GRAY2RGB,
           'rgba8': cv2.COLOR_RGBA2RGB, 'bgra8': cv2.COLOR_BGRA2RGB,
           'yuv422': cv2.COLOR_YUV2RGB_UYVY, 'uyvy': cv2.COLOR_YUV2RGB_UYVY,
           'yuv422_yuy2': cv2.COLOR_YUV2RGB_YUY2, 'yuyv': cv2.COLOR_YUV2RGB_YUY2,
           'bayer_rggb8': cv2.COLOR_BayerRGGB2RGB, 'bayer_bggr8': cv2.COLOR_BayerBGGR2RGB,
           'bayer_gbrg8': cv2.COLOR_BayerGBRG2RGB, 'bayer_grbg8': cv2.COLOR_BayerGRBG2RGB}
_BAND = 32  # rows that are worked on at once, so that they stay in a processor's cache
_LEAST_BAYER = 3  # pixels a side: a smaller image has no pixel with all neighbours


def image_from_msg(msg: Image) -> NDArray[np.uint8]:
    """
    Return a camera's image, (height, width, 3) uint8 RGB.

    Reads rgb8, bgr8, mono8, rgba8 and bgra8 (laid on white where transparent), 8UC3 as OpenCV's
    blue, green, red, 32FC3, RGB in [0, 1], uyvy (also named yuv422) and yuyv (yuv422_yuy2), of
    BT.601 in [16, 235], and 8-bit Bayer patterns, whose missing colours are interpolated. An
    image of rgb8 shares the message's memory.
    Raises MessageError as `image_size_from_msg` does, and on values of 32FC3 that are NaN or out
    of range.
    """
    dtype, channels = _layout(msg)
    pixels = _pixels(msg, dtype, channels)
    if msg.encoding == '32FC3':
        return _from_float(pixels)
    if msg.encoding == 'rgb8':
        return pixels
    to_rgb = _TO_RGB[msg.encoding]
    if channels == 4:
        return over_white(pixels, to_rgb)
    return np.asarray(cv2.cvtColor(pixels, to_rgb), np.uint8)


def image_size_from_msg(msg: Image) -> tuple[int, int]:
    """
    Return the height and width of a camera's image.

    Raises MessageError on an encoding that `image_from_msg` does not read, on an empty image, and
    on too few bytes for its size.
    """
    _check_size(msg, *_layout(msg))
    return int(msg.height), int(msg.width)


def image_to_msg(image: NDArray[np.uint8], header: Header) -> Image:
    """Return an RGB image, (height, width, 3) uint8, as rgb8."""
    return _image_msg(image, 'rgb8', header)


def latent_from_msg(msg: Image) -> NDArray[np.float32]:
    """Return a latent, (C, h, w) float32; raises MessageError unless it is a finite 32FC<C>."""
    encoding = re.fullmatch(r'32FC([1-9]\d*)', msg.encoding)
    if encoding is None:
        raise MessageError('unknown latent encoding: expected 32FC<channels>, got '
                           f'{msg.encoding!r}', 'encoding')
    latent = _pixels(msg, _FLOAT, int(encoding[1]))
    if not np.isfinite(latent).all():
        raise MessageError('latent not finite: got NaN or infinity', 'image_values')
    return np.ascontiguousarray(latent.transpose(2, 0, 1), np.float32)


def latent_to_msg(latent: NDArray[np.float32], header: Header) -> Image:
    """Return a latent, (C, h, w) float32, as an image of encoding 32FC<C>."""
    return _image_msg(latent.transpose(1, 2, 0), f'32FC{len(latent)}', header)


def mask_from_msg(msg: Image) -> NDArray[np.bool_]:
    """
    Return a mask of the object, (height, width): True where the message is not 0.

    Raises MessageError unless it is mono8 or 8UC1, if it is empty, or has too few bytes.
    """
    if msg.encoding not in MASK_ENCODINGS:
        raise MessageError(f'unknown mask encoding: expected {" or ".join(MASK_ENCODINGS)}, '
                           f'got {msg.encoding!r}', 'mask')
    return np.asarray(_pixels(msg, _BYTE, 1)[..., 0] != 0)


def mask_to_msg(mask: NDArray[np.bool_], header: Header) -> Image:
    """Return a mask, (height, width), as mono8: 255 where the object is, else 0."""
    return _image_msg(mask[..., None] * np.uint8(255), 'mono8', header)


def depth_from_msg(msg: Image) -> NDArray[np.float32]:
    """
    Return depth in metres, (height, width); as in REP-118, 0, NaN and infinity are no value.

    Raises MessageError unless it is 16UC1 (or mono16), in millimetres, or 32FC1, in metres, if it
    is empty, or has too few bytes.
    """
    if msg.encoding not in DEPTH_ENCODINGS:
        raise MessageError(f'unknown depth encoding: expected {", ".join(DEPTH_ENCODINGS)}, got '
                           f'{msg.encoding!r}', 'depth')
    kind = DEPTH_ENCODINGS[msg.encoding]
    values = _pixels(msg, kind, 1)[..., 0].astype(np.float32)
    return values if kind == _FLOAT else values / np.float32(MM_PER_METRE)


def depth_to_msg(metres: NDArray[np.floating], header: Header) -> Image:
    """Return depth in metres, (height, width), as 32FC1."""
    return _image_msg(np.asarray(metres, np.float32)[..., None], '32FC1', header)


def over_white(pixels: NDArray[np.uint8],
               to_rgb: int = cv2.COLOR_RGBA2RGB) -> NDArray[np.uint8]:
    """
    Return an image of straight alpha, (H, W, 4), laid on white, (H, W, 3) RGB.

    `to_rgb` is OpenCV's code of the conversion of its colours.
    """
    laid = np.empty((*pixels.shape[:2], 3), np.uint8)
    for top in range(0, len(pixels), _BAND):
        rows, color = pixels[top:top + _BAND], laid[top:top + _BAND]
        cv2.cvtColor(rows, to_rgb, dst=color)
        alpha = cv2.extractChannel(rows, 3)
        if alpha.min() < 255:
            # 255 - (255 - color) alpha / 255: with odd 255 no value is halfway, rounding is exact
            cv2.bitwise_not(color, dst=color)
            cv2.multiply(color, cv2.cvtColor(alpha, cv2.COLOR_GRAY2RGB), dst=color, scale=1 / 255)
            cv2.bitwise_not(color, dst=color)
    return laid


def _image_msg(pixels: NDArray[Any], encoding: str,
               header: Header) -> Image:
    height, width, channels = pixels.shape
    # An array.array is assigned in microseconds, any other sequence is copied byte by byte.
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(pixels).reshape(-1).view(np.uint8).data)
    return Image(header=header, height=height, width=width, encoding=encoding,
                 step=width * channels * pixels.itemsize, data=data)


def _layout(msg: Image) -> tuple[np.dtype[Any], int]:
    """Return the type of the values and their number in a pixel."""
    if msg.encoding not in ENCODINGS:
        raise MessageError(f'unknown image encoding: expected one of {", ".join(ENCODINGS)}, '
                           f'got {msg.encoding!r}', 'encoding')
    return ENCODINGS[msg.encoding]


def _check_size(msg: Image, dtype: np.dtype[Any], channels: int) -> None:
    if msg.height == 0 or msg.width == 0:
        raise MessageError('empty image: expected a width and a height above 0, '
                           f'got {msg.width} x {msg.height}', 'image_size')
    if (dtype, channels) == (_BYTE, 2) and msg.width % 2:  # YUV: two pixels share their colours
        raise MessageError(f'invalid image width: expected an even one for {msg.encoding}, got '
                           f'{msg.width}', 'image_size')
    if msg.encoding.startswith('bayer_') and min(msg.height, msg.width) < _LEAST_BAYER:
        raise MessageError(f'image too small: expected {_LEAST_BAYER} pixels a side or more for '
                           f'{msg.encoding}, got {msg.width} x {msg.height}', 'image_size')
    row = msg.width * channels * dtype.itemsize
    if msg.step < row:
        raise MessageError(f'invalid image rows: expected at least {row} bytes for {msg.width} '
                           f'pixels of {msg.encoding}, got a step of {msg.step}', 'image_bytes')
    expected = msg.step * msg.height
    if len(msg.data) < expected:
        raise MessageError(f'image data too short: expected {expected} bytes for {msg.height} '
                           f'rows of {msg.step}, got {len(msg.data)}', 'image_bytes')


def _pixels(msg: Image, dtype: np.dtype[Any], channels: int) -> NDArray[Any]:
    """Return the pixels, (height, width, channels), in the message's memory if possible."""
    _check_size(msg, dtype, channels)
    rows = np.frombuffer(msg.data, np.uint8, msg.step * msg.height).reshape(msg.height, msg.step)
    row = rows[:, :msg.width * channels * dtype.itemsize]
    if dtype != _BYTE:
        ordered = dtype.newbyteorder('>' if msg.is_bigendian else '<')
        row = np.ascontiguousarray(row).view(ordered)
    return row.reshape(msg.height, msg.width, channels)


def _from_float(pixels: NDArray[Any]) -> NDArray[np.uint8]:
    lowest, highest = pixels.min(), pixels.max()  # NaN where any value is
    if not (lowest >= 0 and highest <= 1):
        raise MessageError('image values out of range: expected 32FC3 in [0, 1], got '
                           f'{lowest} to {highest}', 'image_values')
    scaled: NDArray[np.uint8] = np.rint(pixels * np.float32(255)).astype(np.uint8)
    return scaled
