"""What a camera sends, raw or compressed: its size told at once, its pixels when asked for."""

from io import BytesIO

from active_recon.errors import MessageError
import cv2
from msg_tools.images import image_from_msg, image_size_from_msg, over_white
import numpy as np
from numpy.typing import NDArray
import PIL.Image
from sensor_msgs.msg import CompressedImage, Image

MOST_PIXELS = 1 << 26
"""Compressed images of more are refused: a small file may claim any size."""
_UNREADABLE = (OSError, ValueError, SyntaxError, PIL.Image.DecompressionBombError,
               PIL.Image.DecompressionBombWarning)


def pixels_from_msg(msg: Image | CompressedImage) -> NDArray[np.uint8]:
    """Return the image, (height, width, 3) uint8 RGB; raises MessageError where it is none."""
    return compressed_image_from_msg(msg) if _is_compressed(msg) else image_from_msg(msg)


def size_from_msg(msg: Image | CompressedImage) -> tuple[int, int]:
    """
    Return height and width of an image that is not unpacked.

    Raises MessageError on what can be known to be no image without unpacking it.
    """
    if not _is_compressed(msg):
        return image_size_from_msg(msg)
    packed = _opened(msg)
    return packed.height, packed.width


def compressed_image_from_msg(msg: CompressedImage) -> NDArray[np.uint8]:
    """
    Return a camera's image, (height, width, 3) uint8 RGB; what is transparent becomes white.

    Reads JPEG and PNG. Raises MessageError on anything else, and on images of more than
    `MOST_PIXELS` before they are unpacked.
    """
    packed = _opened(msg)
    if packed.mode in ('RGB', 'L') and not packed.has_transparency_data:
        return _unpacked(msg)
    try:
        if packed.has_transparency_data:
            rgba = np.asarray(packed.convert('RGBA'))
            return over_white(np.ascontiguousarray(rgba[..., :3]), rgba[..., 3])
        return np.asarray(packed.convert('RGB'))
    except _UNREADABLE as error:
        raise _refusal(msg, str(error)) from error


def _is_compressed(msg: Image | CompressedImage) -> bool:
    return hasattr(msg, 'format')  # out of a bag it has the fields of ROS's class alone


def _opened(msg: CompressedImage) -> PIL.Image.Image:
    """Return the image, its head read and checked."""
    try:
        packed = PIL.Image.open(BytesIO(msg.data), formats=('JPEG', 'PNG'))
    except _UNREADABLE as error:
        raise _refusal(msg, str(error)) from error
    if packed.width * packed.height > MOST_PIXELS:
        raise MessageError(f'expected an image of at most {MOST_PIXELS} pixels, got '
                           f'{packed.height} x {packed.width}', 'image_size')
    return packed


def _unpacked(msg: CompressedImage) -> NDArray[np.uint8]:
    """Return the pixels by OpenCV, which takes half of Pillow's time for the same bits."""
    # A camera is calibrated for its pixels as they are, not for what a note in the file says
    how = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        pixels = cv2.imdecode(np.frombuffer(msg.data, np.uint8), how)
    except cv2.error as error:
        raise _refusal(msg, str(error)) from error
    if pixels is None:
        raise _refusal(msg, 'its bytes end too early or are damaged')
    # In place; reading as RGB at once would want an OpenCV newer than a distribution's
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB, pixels), np.uint8)


def _refusal(msg: CompressedImage, why: str) -> MessageError:
    return MessageError(
        f'expected a compressed image as JPEG or PNG, got {msg.format!r}: {why}', 'encoding')
