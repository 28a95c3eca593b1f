"""Images larger than Pillow opens by itself, up to a limit."""

from collections.abc import Iterator
from contextlib import contextmanager
import logging
from pathlib import Path
from threading import RLock
from typing import BinaryIO
import warnings

from active_recon.errors import DataError
from active_recon.photos.formats import require_reader
from PIL import Image

MOST_PIXELS = 400_000_000
# What Pillow and its plugins raise, also as pixels are read
_UNREADABLE = (EOFError, OSError, RuntimeError, SyntaxError, ValueError)
_PILLOWS_LIMIT = RLock()
# What makes a photo unusable is said in one line here, not by the library
logging.getLogger('PIL').setLevel(logging.CRITICAL)
warnings.filterwarnings('ignore', category=UserWarning, module=r'PIL\.')


@contextmanager
def opened(source: Path | BinaryIO, most_pixels: int = MOST_PIXELS,
           formats: tuple[str, ...] | None = None) -> Iterator[Image.Image]:
    """
    Open an image; phones take photos beyond Pillow's own limit of 179 megapixels.

    HEIC comes upright, as `turned_already` tells. Raises DataError where its format cannot be
    read, where it has more than `most_pixels`, and where it is found, as it is opened or as its
    pixels are read, to be no whole image.
    """
    try:
        if formats is None:
            require_reader(source)
        with _opened(source, formats) as image:
            if image.width * image.height > most_pixels:
                raise DataError(f'{image.width} x {image.height} pixels, more than '
                                f'{most_pixels / 1e6:.0f} million')
            yield image
    except _UNREADABLE as error:
        raise DataError(' '.join(str(error).split())) from error


@contextmanager
def _opened(source: Path | BinaryIO, formats: tuple[str, ...] | None) -> Iterator[Image.Image]:
    """Open an image without Pillow's limit, which holds as the pixels of TIFF are read, too."""
    with _PILLOWS_LIMIT:
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            with Image.open(source, formats=formats) as image:
                yield image
        finally:
            Image.MAX_IMAGE_PIXELS = limit
