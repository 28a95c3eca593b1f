"""
PASCAL3D+ as downloaded: photographs with a box, a viewpoint and a CAD model for each object.

    <root>/Annotations/<class>_<source>/<id>.mat  record.objects: class, bbox, cad_index, viewpoint
    <root>/Images/<class>_<source>/<id>.jpg       (or .JPEG)
    <root>/CAD/<class>/<NN>.off                   z up, the front at -y

The annotated azimuth is 0 in front of the object, at -y of the CAD model, and increases towards
+x. `active-recon render CAD OUT --up z --front -y` turns the models' front to +x; the annotated
azimuth then is that of our object frame, with the same sign.

The dataset: Xiang, Mottaghi and Savarese, "Beyond PASCAL: a benchmark for 3D object detection in
the wild", WACV 2014.
"""

from collections.abc import Iterator, Sequence
import math
from pathlib import Path
from typing import Any

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.photographs import Photograph
from active_recon.errors import DataError
import numpy as np
from scipy.io import loadmat

CLASSES = {'aeroplane': 'airplane', 'boat': 'watercraft', 'diningtable': 'table',
           'tvmonitor': 'monitor'}
"""Category names of the classes that are named differently here."""
CAD_UP, CAD_FRONT = 'z', '-y'
_FLAGS = ('truncated', 'occluded', 'difficult')
_SUFFIXES = ('.jpg', '.JPEG', '.jpeg', '.png')


def require_pascal3d(root: Path) -> None:
    """Raise DataError where the folder is not PASCAL3D+."""
    for name in ('Annotations', 'Images', 'CAD'):
        if not (root / name).is_dir():
            raise DataError(f'{root}: not the PASCAL3D+ dataset: expected its folders '
                            f'Annotations, Images and CAD, found no folder {name}')


def list_photographs(root: Path, categories: Sequence[str] = ()) -> tuple[
        list[Photograph], list[str]]:
    """
    Return the photographed objects of some categories (default: all), and the reasons of others.

    Truncated, occluded and difficult objects are left out, as usual, and those without a
    viewpoint or with unreadable files; for each there is a line with the reason. Raises DataError
    if the folder is not PASCAL3D+ or lacks one of the categories.
    """
    require_pascal3d(root)
    folders = [(folder, CLASSES.get(kind, kind))
               for folder in sorted((root / 'Annotations').iterdir())
               if folder.is_dir() and (kind := folder.name.rpartition('_')[0])]
    missing = set(categories) - {category for _, category in folders}
    if missing or not folders:
        wanted = ', '.join(sorted(missing)) or 'any category'
        there = ', '.join(sorted({category for _, category in folders})) or 'none'
        raise DataError(f'{root}: no such annotations: expected those of {wanted}, got those of '
                        f'{there}')
    outcomes = [outcome for folder, category in folders
                if not categories or category in categories
                for path in sorted(folder.glob('*.mat'))
                for outcome in _photographs(root, path, category)]
    return ([outcome for outcome in outcomes if isinstance(outcome, Photograph)],
            [outcome for outcome in outcomes if isinstance(outcome, str)])


def _photographs(root: Path, path: Path, category: str) -> Iterator[Photograph | str]:
    """Yield the objects of a file that have its folder's class, or the reason against each."""
    kind = path.parent.name.rpartition('_')[0]
    try:
        # A list of one is read as its element, a structure as an object with attributes
        record = loadmat(path, squeeze_me=True, struct_as_record=False)['record']
        objects = np.atleast_1d(record.objects)
    except Exception as error:  # scipy's reader raises whatever its parser raised
        yield (f'{path}: no readable annotation: expected a MATLAB file with record.objects, but '
               f'reading it failed with {type(error).__name__}: {error}')
        return
    for number, item in enumerate(objects, start=1):
        try:
            if _field(item, 'class') == kind:
                yield _photograph(root, path, ObjectFolder(
                    root, category, f'{path.parent.name}/{path.stem}/{number}'), item)
        except (DataError, ValueError, TypeError) as error:
            yield f'{path}: object {number}: {error}'


def _photograph(root: Path, path: Path, folder: ObjectFolder, item: Any) -> Photograph:
    flagged = [flag for flag in _FLAGS if np.any(getattr(item, flag, 0))]
    if flagged:
        raise DataError(f'it is {" and ".join(flagged)}')
    viewpoint = _field(item, 'viewpoint')
    # A distance of 0 means that only the coarse angles were annotated
    fine = hasattr(viewpoint, 'azimuth') and np.any(getattr(viewpoint, 'distance', 1))
    precision = '' if fine else '_coarse'
    azimuth, elevation = (math.radians(float(_field(viewpoint, angle + precision)))
                          for angle in ('azimuth', 'elevation'))
    left, top, right, bottom = map(float, _field(item, 'bbox'))
    if not (0 < right - left < math.inf and 0 < bottom - top < math.inf):
        raise DataError(f'invalid box: expected left, top, right, bottom, got {item.bbox}')
    if not (math.isfinite(azimuth) and math.isfinite(elevation)):
        raise DataError(f'invalid viewpoint: expected finite angles, got {azimuth} and '
                        f'{elevation}')
    images = root / 'Images' / path.parent.name
    image = next((images / f'{path.stem}{suffix}' for suffix in _SUFFIXES
                  if (images / f'{path.stem}{suffix}').is_file()), None)
    if image is None:
        raise DataError(f'no image: expected {path.stem}.jpg (or .JPEG) in {images}, found none')
    kind = path.parent.name.rpartition('_')[0]
    cad = root / 'CAD' / kind / f'{int(_field(item, "cad_index")):02d}.off'
    # MATLAB's pixel indices start at 1 and the box includes both ends
    return Photograph(folder, image, (left - 1, top - 1, right, bottom), azimuth, elevation, cad,
                      CAD_UP, CAD_FRONT)


def _field(item: Any, name: str) -> Any:
    value = getattr(item, name, None)
    if value is None or np.size(value) == 0:
        raise DataError(f'missing field: expected {name}, found none')
    return value
