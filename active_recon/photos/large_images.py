"""Images larger than Pillow opens by itself, up to a limit."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import BinaryIO

from active_recon.errors import DataError
from PIL import Image

MOST_PIXELS = 400_000_000
_PILLOWS_LIMIT = Lock()


@contextmanager
def opened(source: Path | BinaryIO, most_pixels: int = MOST_PIXELS,
           formats: tuple[str, ...] | None = None) -> Iterator[Image.Image]:
    """
    Open an image; phones take photos beyond Pillow's own limit of 179 megapixels.

    Raises DataError where it has more than `most_pixels`, and as `Image.open` does.
    """
    with _PILLOWS_LIMIT:
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            image = Image.open(source, formats=formats)
        finally:
            Image.MAX_IMAGE_PIXELS = limit
    with image:
        if image.width * image.height > most_pixels:
            raise DataError(f'{image.width} x {image.height} pixels, more than '
                            f'{most_pixels / 1e6:.0f} million')
        yield image
