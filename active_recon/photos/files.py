"""Photos as files: which there are, how large and how turned they are, and their pixels."""

from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
import hashlib
import math
from pathlib import Path

from active_recon.calibration.files import found_instead, in_order
from active_recon.errors import ConfigError, DataError
from active_recon.photos.color_profiles import in_srgb
from active_recon.photos.depth_files import is_depth
from active_recon.photos.formats import ENDINGS, HEIC_ENDINGS, RAW_ENDINGS, turned_already
from active_recon.photos.large_images import opened
import numpy as np
from numpy.typing import NDArray
from PIL import ExifTags, Image

ORDERS = ('name', 'time')
"""By their names, 2 before 10, or by when they were taken."""
LARGEST_SIDE = 2048
"""Pixels a side to which larger photos are reduced: far more than any network's image has."""
_UNREADABLE = 'unreadable'
_FILM_DIAGONAL = math.hypot(36, 24)  # millimetres, of the film that EXIF's equivalent refers to
_TURNED = {2: Image.Transpose.FLIP_LEFT_RIGHT, 3: Image.Transpose.ROTATE_180,
           4: Image.Transpose.FLIP_TOP_BOTTOM, 5: Image.Transpose.TRANSPOSE,
           6: Image.Transpose.ROTATE_270, 7: Image.Transpose.TRANSVERSE,
           8: Image.Transpose.ROTATE_90}
_TURNED_BACK = {**_TURNED, 6: Image.Transpose.ROTATE_90, 8: Image.Transpose.ROTATE_270}
_WITH_MEANS = {'L', 'RGB', 'RGBA', 'CMYK'}
_MODES_OF_PROFILES = {'RGB', 'RGBA'}  # of CMYK the colours are made without its profile


@dataclass(frozen=True)
class PhotoFile:
    """
    A photo that can be opened.

    - size: width and height as stored, pixels; orientation: EXIF's, 1 (as stored) to 8
    - focal: focal length by EXIF, pixels of the photo as stored; None where it says nothing
    - taken: when, by EXIF, in a form that sorts; '' where it says nothing
    - lost: how many photos that cannot be read come between it and the next one
    """

    path: Path
    size: tuple[int, int]
    orientation: int = 1
    focal: float | None = None
    taken: str = ''
    lost: int = 0

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name

    @property
    def upright_size(self) -> tuple[int, int]:
        """Width and height once turned as EXIF says, pixels."""
        return self.size[::-1] if self.orientation >= 5 else self.size

    @property
    def film_focal(self) -> float | None:
        """Focal length by EXIF with the same diagonal of view on film, millimetres."""
        return None if self.focal is None else self.focal / math.hypot(*self.size) * _FILM_DIAGONAL


def is_photo(path: Path) -> bool:
    """
    Return whether what a folder has is a photo, by its name.

    Hidden files (what a phone has in its bin, what is not whole yet), depth images, folders and
    pipes are none. Raw photos, which cannot be read, are some: they have to be told of.
    """
    return (path.suffix.lower() in (*ENDINGS, *RAW_ENDINGS)
            and not path.name.startswith(('.', '~')) and not is_depth(path)
            and (path.is_file() or not path.exists()))  # a link to nothing is told of


def photos_in(folder: Path) -> list[Path]:
    """Return what `is_photo` in a folder, but no raw photo beside another one of its name."""
    paths = list(filter(is_photo, folder.iterdir()))
    raw = {path for path in paths if path.suffix.lower() in RAW_ENDINGS}
    developed = {path.stem for path in paths if path not in raw}
    return [path for path in paths if path not in raw or path.stem not in developed]


def photo_paths(place: Path | Sequence[Path]) -> list[Path]:
    """
    Return the photos of a folder in the order of their names, 2 before 10; a list stays as it is.

    They are those of `photos_in`. Raises DataError where the folder is missing or has none.
    """
    if not isinstance(place, Path):
        return list(place)
    if not place.is_dir():
        wrong = 'a file' if place.exists() else 'no such folder'
        raise DataError(f'{place}: {wrong}: expected a folder with photos '
                        f'({", ".join(ENDINGS)})', 'no_photos')
    paths = sorted(photos_in(place), key=in_order)
    if not paths:
        within = ', '.join(_folders_with_photos(place))
        raise DataError(f'{place}: no photos: expected files of {", ".join(ENDINGS)}, found '
                        f'{found_instead(place)}'
                        f'{within and f"; give one of its folders that have some: {within}"}',
                        'no_photos')
    return paths


def _folders_with_photos(place: Path) -> list[str]:
    """Return which folders in a folder have photos, by their names."""
    found = []
    for each in sorted(place.iterdir(), key=in_order):
        with suppress(OSError):  # of one that may not be looked into
            if (each.is_dir() and not each.name.startswith('.')
                    and any(map(is_photo, each.iterdir()))):
                found.append(each.name)
    return found


def open_photos(paths: Iterable[Path]) -> tuple[list[PhotoFile], list[str]]:
    """
    Return the photos among files, and why the others are left out.

    A photo whose file has the same bytes as one before is left out, and HEIC that another file has
    the name of but for the ending: one was made from the other. One that cannot be read is `lost`
    after the one before it, unless another file has its name. Raises DataError where none is left.
    """
    paths = list(paths)
    named = Counter(path.with_suffix('') for path in paths)
    converted = {path.with_suffix(''): path for path in paths
                 if path.suffix.lower() not in HEIC_ENDINGS}
    photos: list[PhotoFile] = []
    left_out: list[str] = []
    known: dict[bytes, Path] = {}
    for path in paths:
        twin = converted.get(path.with_suffix(''))
        try:
            if twin is not None and path.suffix.lower() in HEIC_ENDINGS:
                raise DataError(f'{path.name}: the same photo as {twin.name}')
            photos.append(open_photo(path, known))
        except DataError as error:
            left_out.append(str(error))
            if photos and error.kind == _UNREADABLE and named[path.with_suffix('')] == 1:
                photos[-1] = replace(photos[-1], lost=photos[-1].lost + 1)
    if not photos:
        # Of many for the same reason the first
        different = {reason.partition(': ')[2]: reason for reason in reversed(left_out)}
        raise DataError('no readable photo: expected at least one, got none'
                        + ''.join(f'; {reason}' for reason in [*different.values()][:-4:-1]),
                        'no_photos')
    return photos, left_out


def open_photo(path: Path, known: dict[bytes, Path]) -> PhotoFile:
    """
    Return the photo of a file, which is noted in `known`: paths of photos by their bytes' hash.

    Raises DataError where it cannot be read, or one of `known` has the same bytes.
    """
    try:
        stored = path.read_bytes()
        if not stored:
            raise DataError('a file of 0 bytes')
        digest = hashlib.sha256(stored).digest()
        photo = _opened(path)
    except (DataError, OSError) as error:
        raise DataError(f'{path.name}: not readable: expected a whole image, got: '
                        f'{error}', _UNREADABLE) from error
    if digest in known:
        same = known[digest]
        raise DataError(f'{path.name}: the same photo as '
                        f'{same if same.name == path.name else same.name}')
    known[digest] = path
    return photo


def in_order_of(order: str, photos: Sequence[PhotoFile]) -> list[PhotoFile]:
    """
    Return photos in one of ORDERS; those of the same time stay as they are.

    Raises ConfigError on another order, DataError where EXIF has no time of a photo.
    """
    if order not in ORDERS:
        raise ConfigError(f'order: unknown value: expected one of {", ".join(ORDERS)}, got '
                          f'{order!r}')
    if order == 'name':
        return list(photos)
    for photo in photos:
        if not photo.taken:
            raise DataError(f'{photo.name}: no time: expected when it was taken in EXIF; sort the '
                            'photos by their names instead', 'no_time')
    return sorted(photos, key=lambda photo: photo.taken)


def read_photo(photo: PhotoFile, upright: bool = True) -> NDArray[np.uint8]:
    """
    Return a photo's pixels, (H, W, 3) uint8 RGB, or (H, W, 4) with straight alpha.

    It is turned as EXIF says, or as stored without `upright`; larger ones are reduced to
    `LARGEST_SIDE` or less; 16 bits a channel become 8, colours of another space sRGB. Raises
    DataError where the file is damaged or has a format without a meaning in colours.
    """
    try:
        with opened(photo.path) as image:
            already = turned_already(image)
            if max(image.size) > LARGEST_SIDE:
                # A JPEG is then decoded at an eighth to a half of its size
                image.draft('RGB', (LARGEST_SIDE, LARGEST_SIDE))
            image.load()
            pixels = _reduced(_eight_bits(_reduced(image)))
            if image.mode in _MODES_OF_PROFILES:
                pixels = in_srgb(pixels, image.info.get('icc_profile'))
    except DataError as error:
        raise DataError(f'{photo.name}: not readable: expected a whole image, got: '
                        f'{error}') from error
    turns = _TURNED if upright else _TURNED_BACK
    if upright == (already == 1) and photo.orientation in turns:
        pixels = pixels.transpose(turns[photo.orientation])
    return np.asarray(pixels, np.uint8)


def _opened(path: Path) -> PhotoFile:
    with opened(path) as image:
        exif = Image.Image.getexif(image)  # that of PNG would decode the whole image
        already = turned_already(image)
        turned = already if already != 1 else exif.get(ExifTags.Base.Orientation, 1)
        size = image.size[::-1] if already >= 5 else image.size
        return PhotoFile(path, size, turned if turned in _TURNED else 1,
                         _focal(exif, image.size), _taken(exif))


def _focal(exif: Image.Exif, size: tuple[int, int]) -> float | None:
    """Return the focal length in pixels by EXIF's 35 mm equivalent, else by its sensor."""
    found = exif.get_ifd(ExifTags.IFD.Exif)
    try:
        equivalent = float(found.get(ExifTags.Base.FocalLengthIn35mmFilm, 0))
        if equivalent > 0:
            return equivalent / _FILM_DIAGONAL * math.hypot(*size)
        focal = float(found[ExifTags.Base.FocalLength])
        per_unit = float(found[ExifTags.Base.FocalPlaneXResolution])
        unit = {2: 25.4, 3: 10.0, 4: 1.0}[found.get(ExifTags.Base.FocalPlaneResolutionUnit, 2)]
        # That is of the photo as it was taken, which may have been made smaller since
        taken = float(found.get(ExifTags.Base.ExifImageWidth, 0)) or max(size)
        taken = max(taken, float(found.get(ExifTags.Base.ExifImageHeight, 0)))
        pixels = focal * per_unit / unit * max(size) / taken
        return pixels if 0 < pixels < math.inf else None
    except (KeyError, TypeError, ValueError, ZeroDivisionError):
        return None


def _taken(exif: Image.Exif) -> str:
    """Return when a photo was taken, as 'YYYY:MM:DD HH:MM:SS' and parts of a second."""
    found = exif.get_ifd(ExifTags.IFD.Exif)
    taken = str(found.get(ExifTags.Base.DateTimeOriginal, '')).strip('\0 ')
    parts = str(found.get(ExifTags.Base.SubsecTimeOriginal, '')).strip('\0 ')
    return f'{taken}.{parts}' if taken else ''


def _reduced(image: Image.Image) -> Image.Image:
    """Return an image of at most LARGEST_SIDE; unchanged where its mode has no means."""
    factor = math.ceil(max(image.size) / LARGEST_SIDE)
    return image.reduce(factor) if factor > 1 and image.mode in _WITH_MEANS else image


def _eight_bits(image: Image.Image) -> Image.Image:
    """Return an image of RGB or RGBA with 8 bits a channel."""
    if image.mode.startswith(('I', 'F')):  # grey of 16 bits, of 32, or of floats
        values = np.asarray(image, np.float64)
        if image.mode == 'F' or values.min() < 0 or values.max() > 65535:
            raise DataError(f'its pixels are numbers of mode {image.mode}, not a photo')
        image = Image.fromarray((values / 257).astype(np.uint8))
    has_alpha = 'A' in image.mode or 'transparency' in image.info
    return image.convert('RGBA' if has_alpha else 'RGB')
