"""Splits of ShapeNet as R2N2 publishes it: its categories, and the objects of each part."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.errors import ConfigError, DataError
from active_recon.json_text import json_value

SYNSETS = {
    '02691156': 'airplane', '02828884': 'bench', '02933112': 'cabinet', '02958343': 'car',
    '03001627': 'chair', '03211117': 'monitor', '03636649': 'lamp', '03691459': 'speaker',
    '04090263': 'firearm', '04256520': 'sofa', '04379243': 'table', '04401088': 'cellphone',
    '04530566': 'watercraft'}
"""R2N2's thirteen folders of ShapeNet, and their category names here."""
SORTED = 'sorted'
PORTIONS = {'train': (0.0, 0.7), 'val': (0.7, 0.8), 'test': (0.8, 1.0)}
"""
The fractions of a category's sorted ids that form each part, where no split file is given.

3D-R2N2's own code trains on the first 80 percent, whose last part is `val` here, and tests on the
last 20.
"""

Listed = tuple[list[ObjectFolder], list[str]]


def list_split(root: Path, split: Path | str, part: str) -> Listed:
    """
    Return the objects of one part of a dataset, and a line for each object missing on disk.

    `split` is a published split file, or 'sorted' to cut every category's sorted ids by
    `PORTIONS`; `part` is train, val or test. A split file is JSON with a record for each category:
    `taxonomy_id` (the folder's name) and the lists of ids `train`, `val` and `test`. The records
    are in a list, or in an object with the ids as keys; several may be of one category, and an
    object that is named twice is one. Raises DataError where the file is invalid or none of its
    objects exists, ConfigError on any other part.
    """
    if part not in PORTIONS:
        raise ConfigError(f'part: no such part: expected one of {", ".join(PORTIONS)}, got '
                          f'{part!r}')
    there = list_objects(root)
    if str(split) == SORTED:
        return list(_sorted_part(there, part)), []
    wanted = list(dict.fromkeys(_read_split(Path(split), part)))
    by_name = {(folder.category, folder.name): folder for folder in there}
    found = [by_name[key] for key in wanted if key in by_name]
    if not found:
        raise DataError(f"{root}: none of the split's objects: expected the {len(wanted)} "
                        f'objects that {split} names for {part}; are its folders named as the '
                        'file does, by their synset?')
    return found, [f'{root}: no such folder: expected {category}/{name} of {part}'
                   for category, name in wanted if (category, name) not in by_name]


def _sorted_part(folders: list[ObjectFolder], part: str) -> Iterator[ObjectFolder]:
    first, last = PORTIONS[part]
    for category in dict.fromkeys(folder.category for folder in folders):
        alike = [folder for folder in folders if folder.category == category]
        yield from alike[int(len(alike) * first):int(len(alike) * last)]


def _read_split(path: Path, part: str) -> list[tuple[str, str]]:
    """Return the objects of a part: the category's folder and the id of each."""
    try:
        content = json_value(path.read_bytes())
    except (OSError, ValueError) as error:
        raise DataError(f'{path}: no readable split file: expected JSON, got: {error}') from error
    if isinstance(content, dict):
        content = [{'taxonomy_id': key, **record} if isinstance(record, dict) else record
                   for key, record in content.items()]
    if not isinstance(content, list) or not content:
        raise DataError(f'{path}: invalid split: expected a record for each category, got '
                        f'{content!r:.80}')
    wanted: list[tuple[str, str]] = []
    for record in content:
        category, names = _fields(record, part)
        if not isinstance(category, str) or not isinstance(names, list) or not all(
                isinstance(name, str) for name in names):
            raise DataError(f'{path}: invalid record: expected a taxonomy_id and a list of ids '
                            f'{part!r}, got {record!r:.80}')
        wanted += [(category, name) for name in names]
    return wanted


def _fields(record: Any, part: str) -> tuple[Any, Any]:
    return (record.get('taxonomy_id'), record.get(part)) if isinstance(record, dict) else (0, 0)
