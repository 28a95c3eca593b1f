"""Images between ROS and numpy: how fast, and how many times as long as a plain copy."""

from array import array
from collections.abc import Callable

from benchmarks.figures import Figure, timed_ms
from msg_tools.images import ENCODINGS, image_from_msg, image_to_msg
import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header

_HEIGHT, _WIDTH = 1080, 1920
_REPEATS = 30
_MOST_COPIES = {'rgb8': 1.0, '32FC3': 12.0, 'rgba8': 8.0, 'bgra8': 8.0}
_MOST_COPIES_ELSE = 4.0


def converter_figures() -> list[Figure]:
    """Read each encoding, and write rgb8, in turns with a copy of the same message's bytes."""
    image = np.random.default_rng(0).integers(0, 256, (_HEIGHT, _WIDTH, 3), np.uint8)
    msg = _message('rgb8')
    figures = [
        Figure('rgb8 to an array', 'GB/s', _rates(lambda: image_from_msg(msg), image.nbytes), 1,
               more_is_better=True),
        Figure('an array to rgb8', 'GB/s',
               _rates(lambda: image_to_msg(image, Header()), image.nbytes), 1,
               more_is_better=True),
        Figure('an array to rgb8', 'x copy',
               _copies(lambda: image_to_msg(image, Header()), image), 2)]
    for encoding in ENCODINGS:
        msg = _message(encoding)
        figures.append(Figure(
            f'{encoding} to an array', 'x copy',
            _copies(lambda m=msg: image_from_msg(m), np.frombuffer(msg.data, np.uint8)),
            _MOST_COPIES.get(encoding, _MOST_COPIES_ELSE)))
    return figures


def _message(encoding: str) -> Image:
    kind, channels = ENCODINGS[encoding]
    values = np.random.default_rng(0).integers(0, 256, (_HEIGHT, _WIDTH, channels), np.uint8)
    pixels = values if kind == np.uint8 else (values / 255).astype(kind)
    return Image(height=_HEIGHT, width=_WIDTH, encoding=encoding,
                 step=_WIDTH * channels * kind.itemsize, data=array('B', pixels.tobytes()))


def _rates(convert: Callable[[], object], size: int) -> list[float]:
    """Return GB a second of each call."""
    return [size / 1e6 / spent for spent in timed_ms(convert, _REPEATS)]


def _copies(convert: Callable[[], object], data: np.ndarray) -> list[float]:
    """Return how many times as long each call took as the copy just before it."""
    ratios = []
    for _ in range(_REPEATS):
        copied, = timed_ms(data.copy, 1, 1)
        converted, = timed_ms(convert, 1, 1)
        ratios.append(converted / copied)
    return ratios
