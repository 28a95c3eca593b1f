"""Camera images, raw or compressed; their size is read without decoding them."""

import array
from io import BytesIO
import re

from active_recon.errors import MessageError
import cv2
from msg_tools.images import image_from_msg, image_size_from_msg, over_white
import numpy as np
from numpy.typing import NDArray
import PIL.Image
from sensor_msgs.msg import CompressedImage, Image

MAX_PIXELS = 1 << 26
"""Larger compressed images are rejected: a small file may claim any size."""
_REDUCED = {2: cv2.IMREAD_REDUCED_COLOR_2, 4: cv2.IMREAD_REDUCED_COLOR_4,
            8: cv2.IMREAD_REDUCED_COLOR_8}
_GREY = ('L', 'I;16', 'I')
_BAYER = re.compile(r'\s*(bayer_(?:rggb|bggr|gbrg|grbg))(?:8|16)\s*;')
_UNREADABLE = (OSError, ValueError, SyntaxError, PIL.Image.DecompressionBombError,
               PIL.Image.DecompressionBombWarning)


def pixels_from_msg(msg: Image | CompressedImage) -> NDArray[np.uint8]:
    """Return the image, (height, width, 3) uint8 RGB; raises MessageError if it is invalid."""
    return compressed_image_from_msg(msg) if is_compressed(msg) else image_from_msg(msg)


def reduced_from_msg(msg: Image | CompressedImage, by: int) -> NDArray[np.uint8]:
    """
    Return the image with `by` x `by` pixels as one, where that is less work than all of them.

    That is a JPEG image, decoded to (ceil(height / by), ceil(width / by), 3); `by` is 1, 2, 4 or
    8. Any other image is returned whole. Raises MessageError as `pixels_from_msg` does.
    """
    if by > 1 and is_compressed(msg):
        image = _open(msg)
        if image.format == 'JPEG' and image.mode in ('RGB', 'L') and not _bayer(msg, image):
            return _decoded(msg, _REDUCED[by])
    return pixels_from_msg(msg)


def size_from_msg(msg: Image | CompressedImage) -> tuple[int, int]:
    """
    Return the height and width of an image without decoding it.

    Raises MessageError if its header is invalid.
    """
    if not is_compressed(msg):
        return image_size_from_msg(msg)
    header = _open(msg)
    return header.height, header.width


def compressed_image_from_msg(msg: CompressedImage) -> NDArray[np.uint8]:
    """
    Return a camera's image, (height, width, 3) uint8 RGB, laid on white where transparent.

    Reads JPEG and PNG, and interpolates the missing colours of a raw sensor's Bayer pattern, which
    image_transport compresses as a grey image. Raises MessageError on other formats, and on images
    of more than `MAX_PIXELS` before they are decoded.
    """
    image = _open(msg)
    if encoding := _bayer(msg, image):
        values = _decoded(msg)[..., 0]
        return image_from_msg(Image(
            height=image.height, width=image.width, encoding=encoding, step=image.width,
            data=array.array('B', values.tobytes())))
    # Of 16 bits OpenCV takes the upper 8, Pillow white for all that is above 255
    if image.mode in ('RGB', *_GREY) and not image.has_transparency_data:
        return _decoded(msg)
    try:
        if image.has_transparency_data:
            return over_white(np.asarray(image.convert('RGBA')))
        return np.asarray(image.convert('RGB'))
    except _UNREADABLE as error:
        raise _decoding_error(msg, str(error)) from error


def is_compressed(msg: Image | CompressedImage) -> bool:
    """Return whether a message is a CompressedImage, by its fields."""
    return hasattr(msg, 'format')  # messages from a bag are of another class


def _bayer(msg: CompressedImage, image: PIL.Image.Image) -> str:
    """Return the encoding of a raw sensor's values in a grey image, '' where it has none."""
    named = _BAYER.match(msg.format)
    return f'{named[1]}8' if named and image.mode in _GREY else ''


def _open(msg: CompressedImage) -> PIL.Image.Image:
    """Return the image with its header read and checked."""
    try:
        image = PIL.Image.open(BytesIO(msg.data), formats=('JPEG', 'PNG'))
    except PIL.UnidentifiedImageError as error:  # it names an object in memory
        raise _decoding_error(msg, f'{len(msg.data)} bytes of neither') from error
    except _UNREADABLE as error:
        raise _decoding_error(msg, str(error)) from error
    if image.width * image.height > MAX_PIXELS:
        raise MessageError(f'image too large: expected at most {MAX_PIXELS} pixels, got '
                           f'{image.width} x {image.height}', 'image_size')
    return image


def _decoded(msg: CompressedImage, how: int = cv2.IMREAD_COLOR) -> NDArray[np.uint8]:
    """Return the pixels by OpenCV, which gives the same bits in half of Pillow's time."""
    try:
        # The calibration is of the pixels as they are, not as the EXIF orientation turns them
        pixels = cv2.imdecode(np.frombuffer(msg.data, np.uint8),
                              how | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error as error:
        raise _decoding_error(msg, str(error)) from error
    if pixels is None:
        raise _decoding_error(msg, 'its data is incomplete or damaged')
    # In place; decoding to RGB directly needs an OpenCV newer than a distribution's
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB, pixels), np.uint8)


def _decoding_error(msg: CompressedImage, reason: str) -> MessageError:
    return MessageError(f'compressed image not readable: expected JPEG or PNG, got '
                        f'{msg.format!r}: {reason}', 'encoding')
