"""Photos out of a video: of each of so many equal parts the sharpest frame."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeGuard

from active_recon.capture.sources import frame_count, ImageSource, open_source
from active_recon.errors import DataError
from active_recon.photos.formats import ENDINGS, RAW_ENDINGS
from active_recon.reporting import Reporting, silent
import cv2
import numpy as np
from numpy.typing import NDArray

_WHOLE = 0.9  # of the frames that the header tells: of some formats it is an estimate
_COMPARED = 640  # pixels of the longer side at which sharpness is told


def is_video(place: Path | Sequence[Path]) -> TypeGuard[Path]:
    """Return whether a place of photos is one file that is no photo itself."""
    return (isinstance(place, Path) and place.is_file()
            and place.suffix.lower() not in (*ENDINGS, *RAW_ENDINGS))


@contextmanager
def frames_of(path: Path, count: int, reporting: Reporting = silent,
              warn: Callable[[str], None] = lambda words: None) -> Iterator[Path]:
    """
    Yield a folder with frames of a video, PNG, named after it and their number; then remove it.

    The sharpest frame of each of `count` equal parts is there; all of a shorter video. `warn`
    hears of one that has far fewer frames than its header tells. Raises DataError where no frame
    can be read.
    """
    try:
        source = open_source(str(path))
    except DataError as error:
        raise DataError(f'{path}: neither a folder of photos nor a video that can be read',
                        'no_photos') from error
    name = path.stem.lstrip('.~')  # photos of such names are hidden files
    with closing(source), TemporaryDirectory() as place:
        told = frame_count(path)

        def ended(found: int) -> None:
            if found < _WHOLE * told:
                warn(f'{path.name}: only {found} of {told} frames can be read: is the video '
                     'whole?')

        for number, frame in _sharpest(source, told, count, reporting, ended):
            written = Path(place) / f'{name}-{number:05}.png'
            cv2.imwrite(str(written), frame[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])
        yield Path(place)


def _sharpest(source: ImageSource, total: int, count: int, reporting: Reporting,
              ended: Callable[[int], None]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """
    Yield the number and the pixels, (H, W, 3) uint8 RGB, of the sharpest frame of each part.

    `ended` is told how many frames there were.
    """
    part, best, number = 0, None, -1
    with reporting('reading the video', total) as advance:
        while (frame := source.read()) is not None:
            number += 1
            advance(1, '')
            own = min(number, total - 1) * min(count, total) // total  # the file may say too few
            if best is not None and own > part:
                yield best[1], best[2]
                best = None
            sharp = sharpness(frame)
            if best is None or sharp > best[0]:
                part, best = own, (sharp, number, frame)
    if best is not None:
        yield best[1], best[2]
    ended(number + 1)


def sharpness(image: NDArray[np.uint8]) -> float:
    """
    Return how sharp an image, (H, W, 3) uint8 RGB, is, to be held against others of the scene.

    It is the variance of the Laplacian: Pech-Pacheco et al., "Diatom autofocusing in brightfield
    microscopy", ICPR 2000.
    """
    shrink = min(1.0, _COMPARED / max(image.shape[:2]))
    small = cv2.resize(image, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    return float(cv2.Laplacian(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY), cv2.CV_32F).var())
