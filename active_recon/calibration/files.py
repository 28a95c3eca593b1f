"""Input files of a calibration: images, and tables of their angles or poses."""

from contextlib import suppress
import csv
from pathlib import Path
import re
from typing import Any

from active_recon.errors import DataError
from active_recon.file_names import comparable
import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

SUFFIXES = ('.bmp', '.jpeg', '.jpg', '.png', '.tif', '.tiff')


def image_paths(places: list[Path]) -> list[Path]:
    """
    Return image files and the images in folders, sorted by name.

    Numbers in names are sorted as numbers: 2 before 10. Raises DataError where there is no image
    or no such place, or two have the same name.
    """
    if missing := [place for place in places if not place.exists()]:
        raise DataError(f'{missing[0]}: no such file or folder: expected images, or a folder of '
                        'them')
    paths = [path for place in places
             for path in (place.iterdir() if place.is_dir() else [place])
             if not place.is_dir() or (path.suffix.lower() in SUFFIXES
                                       and not path.name.startswith('.'))]
    if not paths:
        raise DataError(f'{", ".join(map(str, places))}: no images: expected some '
                        f'({", ".join(SUFFIXES)}), found {found_instead(*places)}')
    names = [path.name for path in paths]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise DataError(f'images of the same name: expected different names, got {twice[0]} twice')
    return sorted(paths, key=in_order)


def found_instead(*folders: Path) -> str:
    """Return in words what folders without images have."""
    others = sorted((path for folder in folders for path in folder.iterdir()
                     if path.is_file() and not path.name.startswith('.')), key=in_order)
    many = f'{len(others)} others, such as ' if len(others) > 1 else ''
    return f'none, but {many}{others[0].name}' if others else 'none'


def in_order(path: Path) -> list[tuple[int, str]]:
    """Return a key that sorts names with numbers as people do: 2 before 10."""
    return [(int(part), '') if part.isdecimal() else (0, part)
            for part in re.split(r'(\d+)', path.name)]


def read_image(path: Path) -> NDArray[np.uint8]:
    """Return an image, (H, W, 3) uint8 BGR; raises DataError where it cannot be read."""
    # Without rotation by EXIF: a camera's driver publishes images without it
    image = decoded(path, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise DataError(f'{path}: not readable: expected an image file, whole, in a format of '
                        'OpenCV; convert others, such as HEIC, to PNG or JPEG')
    return np.asarray(image, np.uint8)


def decoded(path: Path, how: int) -> NDArray[Any] | None:
    """Return an image as imread does, None where it cannot be read or is not whole."""
    with suppress(OSError, cv2.error):  # OpenCV refuses 0 bytes so
        # Of a file, imread takes what is missing of a JPEG for grey
        return cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), how)
    return None


def read_angles(path: Path, names: list[str]) -> dict[str, float]:
    """
    Return the table's angle in each image, radians.

    The rows of the CSV file are image, degrees, or only degrees in the order of `names`. Raises
    DataError on invalid or missing rows.
    """
    return {name: float(np.radians(row[0])) for name, row in _rows(path, names, 1).items()}


def read_poses(path: Path, names: list[str]) -> dict[str, NDArray[np.float64]]:
    """
    Return the pose of each image, (4, 4), metres.

    The rows of the CSV file are image, x, y, z, qx, qy, qz, qw, or only the numbers in the order
    of `names`. Raises DataError on invalid or missing rows.
    """
    poses = {}
    for name, row in _rows(path, names, 7).items():
        if abs(np.linalg.norm(row[3:]) - 1) > 0.01:
            raise DataError(f'{path}: no rotation: expected a unit quaternion of {name}, got '
                            f'{row[3:]}')
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(row[3:]).as_matrix()
        pose[:3, 3] = row[:3]
        poses[name] = pose
    return poses


def _rows(path: Path, names: list[str], count: int) -> dict[str, list[float]]:
    """
    Return `count` numbers for each image from a CSV file.

    Either each row begins with the image's name, or there is one row of numbers for each image in
    the order of `names`. A heading is skipped. Raises DataError that names the line.
    """
    try:
        with path.open(newline='', encoding='utf-8-sig') as lines:  # spreadsheets mark it
            rows = [(number, [cell.strip() for cell in row])
                    for number, row in enumerate(csv.reader(lines), 1) if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f'{path}: not readable: expected a CSV file: {error}') from error
    if rows and _numbers(rows[0][1][-1:]) is None:
        rows = rows[1:]
    named, unnamed = {}, []
    for number, row in rows:
        values = _numbers(row[-count:])
        if values is None or not count <= len(row) <= count + 1:
            wanted = 'a number' if count == 1 else f'{count} numbers'
            raise DataError(f'{path}, line {number}: wrong row: expected {wanted}, or an image '
                            f'and {wanted}, got {", ".join(row)}')
        if len(row) > count:
            if (name := comparable(Path(row[0]).name)) in named:
                raise DataError(f'{path}, line {number}: a second row for {Path(row[0]).name}: '
                                'expected one for each image')
            named[name] = values
        else:
            unnamed.append(values)
    if unnamed and (named or len(unnamed) != len(names)):
        raise DataError(f'{path}: rows do not match the images: expected one for each of the '
                        f'{len(names)} images, or rows that begin with their names, got '
                        f'{len(unnamed)} without a name')
    if unnamed:
        return dict(zip(names, unnamed, strict=True))
    if missing := [name for name in names if comparable(name) not in named]:
        raise DataError(f'{path}: rows missing: expected one for every image, found none for '
                        f'{", ".join(missing)}')
    return {name: named[comparable(name)] for name in names}


def _numbers(cells: list[str]) -> list[float] | None:
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None
