"""PNG files that are written whole or not at all: `cv2.imwrite` tells nothing of a full disk."""

from collections.abc import Sequence
from pathlib import Path

from active_recon.errors import DataError
from active_recon.whole_files import whole_file
import cv2


def write_png(path: Path, image: 'cv2.typing.MatLike', options: Sequence[int] = ()) -> None:
    """
    Write an image, (H, W) or (H, W, 3 or 4) with channels in OpenCV's order: BGR, BGRA.

    `options` are those of `cv2.imencode`. Raises DataError where the file cannot be written.
    """
    try:
        with whole_file(path) as unfinished:
            unfinished.write_bytes(cv2.imencode('.png', image, options)[1].tobytes())
    except OSError as error:
        raise DataError(f'{path}: cannot be written: {error.strerror}') from error
