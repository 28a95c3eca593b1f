"""
Depth as image_transport's plugin `compressed_depth_image_transport` compresses it.

A header of 12 bytes (its kind, and two floats A and B) goes before a PNG image of 16 bits. Depth
of 16UC1 is stored as it is; of 32FC1 as rint(A / metres + B), 0 where there is none.
"""

import array
import struct

from active_recon.errors import MessageError
from active_recon.volumes.depth_images import MM_PER_METRE
import cv2
from msg_tools.camera_images import is_compressed, MAX_PIXELS
from msg_tools.images import DEPTH_ENCODINGS, depth_from_msg
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

_HEADER = struct.Struct('<iff')
_PNG_START = b'\x89PNG\r\n\x1a\n'
_PNG_SIZE = struct.Struct('>II')
_AT_SIZE = 16  # bytes of a PNG file before its width and height
_MOST_MM = 65535


def metres_from_msg(msg: Image | CompressedImage) -> NDArray[np.float32]:
    """Return depth in metres, (height, width), of either message; raises MessageError."""
    return depth_from_compressed_msg(msg) if is_compressed(msg) else depth_from_msg(msg)


def depth_from_compressed_msg(msg: CompressedImage) -> NDArray[np.float32]:
    """
    Return depth in metres, (height, width); 0 is no value.

    Raises MessageError unless the format is '16UC1; compressedDepth' (or mono16, as of raw images)
    or '32FC1; compressedDepth', with or without 'png' at its end, the data are a header and a PNG
    image of 16 bits and one channel, and it has at most `MAX_PIXELS`.
    """
    encoding, _, transport = (part.strip() for part in msg.format.partition(';'))
    if encoding not in DEPTH_ENCODINGS or transport.split() not in (
            ['compressedDepth'], ['compressedDepth', 'png']):
        hint = '; set png as the format of its publisher' if transport.endswith('rvl') else ''
        raise MessageError("unknown compressed depth: expected '16UC1; compressedDepth png' or "
                           f"'32FC1; compressedDepth png', got {msg.format!r}{hint}", 'depth')
    data = bytes(msg.data)
    packed = data[_HEADER.size:]
    if not packed.startswith(_PNG_START) or len(packed) < _AT_SIZE + _PNG_SIZE.size:
        raise MessageError(f'compressed depth unreadable: expected a header of {_HEADER.size} '
                           f'bytes and a PNG image, got {len(data)} others', 'depth')
    width, height = _PNG_SIZE.unpack_from(packed, _AT_SIZE)
    if width * height > MAX_PIXELS:
        raise MessageError(f'compressed depth too large: expected at most {MAX_PIXELS} pixels, '
                           f'got {width} x {height}', 'depth')
    values = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_UNCHANGED)
    if values is None or values.dtype != np.uint16 or values.ndim != 2:
        raise MessageError('compressed depth unreadable: expected a PNG image of 16 bits and one '
                           'channel', 'depth')
    stored = np.asarray(values, np.float32)
    if DEPTH_ENCODINGS[encoding] == np.uint16:
        return stored / np.float32(MM_PER_METRE)
    _, scale, offset = _HEADER.unpack_from(data)
    if not (0 < scale < np.inf and np.isfinite(offset)):
        raise MessageError('compressed depth without its scale: expected two finite numbers in '
                           f'its header, the first above 0, got {scale:g} and {offset:g}', 'depth')
    above = stored - np.float32(offset)
    there = (stored > 0) & (above > 0)
    return np.where(there, np.float32(scale) / np.where(there, above, 1), 0).astype(np.float32)


def depth_to_compressed_msg(metres: NDArray[np.floating], header: Header) -> CompressedImage:
    """
    Return depth in metres, (height, width), as '16UC1; compressedDepth png', in millimetres.

    What 16 bits cannot hold, from 65.5 metres on, becomes no value, as NaN and infinity do.
    """
    millimetres = np.nan_to_num(np.rint(np.asarray(metres, np.float64) * MM_PER_METRE),
                                posinf=0, neginf=0)
    kept = np.where((millimetres > 0) & (millimetres <= _MOST_MM), millimetres, 0)
    _, packed = cv2.imencode('.png', kept.astype(np.uint16))
    return CompressedImage(header=header, format='16UC1; compressedDepth png', data=array.array(
        'B', _HEADER.pack(0, 0.0, 0.0) + packed.tobytes()))
