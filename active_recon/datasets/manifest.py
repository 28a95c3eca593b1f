"""A manifest of downloaded models: a CSV file with the category, source and licence of each."""

import csv
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import re

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.making import Job, yawed
from active_recon.errors import DataError
from active_recon.geometry.cameras import TURN
from active_recon.volumes.meshes import load_mesh
import numpy as np
import trimesh

_COLUMNS = {'category', 'file', 'split', 'source', 'licence', 'licence_evidence', 'front_axis',
            'sha256'}
_FRONTS = {'+Z': 'z', '+X': 'x', '-Z': '-z', '-X': '-x'}
_HEX = re.compile('[0-9a-fA-F]+')
EXPLICIT = 'explicit for the models'
"""Licence evidence that allows training on a model: the licence names the models themselves."""
_OPEN = re.compile(r'CC0\b|CC-BY(-[0-9]|$)|public[ -]domain', re.IGNORECASE)
"""Licences that require at most attribution; CC-BY-SA requires more."""


@dataclass(frozen=True)
class ModelRow:
    """One row of a manifest; `file` is relative to the manifest's folder."""

    category: str
    file: Path
    split: str
    source: str
    licence: str
    licence_evidence: str
    front_axis: str
    sha256: str

    @property
    def front(self) -> str | None:
        """Front axis of the file, which is y up: such as 'z' or '-x', None where it is unknown."""
        return _FRONTS.get(self.front_axis[:2].upper())

    @property
    def is_open(self) -> bool:
        """Whether shipped weights may be trained on it: explicitly CC0, CC-BY, public domain."""
        return self.licence_evidence == EXPLICIT and bool(_OPEN.match(self.licence))


def read_manifest(path: Path) -> list[ModelRow]:
    """Read the rows of a manifest (CSV); raises DataError where it is unreadable or invalid."""
    try:
        with path.open(newline='', encoding='utf-8-sig') as file:  # spreadsheets write the mark
            reader = csv.DictReader(file)
            rows, columns = list(reader), set(reader.fieldnames or ())
    except (OSError, ValueError, csv.Error) as error:
        raise DataError(f'{path}: no readable manifest: expected a CSV file, got: '
                        f'{error}') from error
    missing = _COLUMNS - columns
    if missing:
        raise DataError(f'{path}: missing columns: expected {", ".join(sorted(_COLUMNS))}; '
                        f'missing: {", ".join(sorted(missing))}')
    for number, row in enumerate(rows, start=2):
        if any(row[column] is None for column in _COLUMNS) or not (
                _HEX.fullmatch(row['sha256'])
                and Path(row['category']).parts == (row['category'],)):
            raise DataError(f'{path}: invalid row: expected every column, a category that can '
                            f'name a folder and a hexadecimal sha256 in line {number}, got {row}')
    return [ModelRow(row['category'], path.parent / row['file'], row['split'], row['source'],
                     row['licence'], row['licence_evidence'], row['front_axis'], row['sha256'])
            for row in rows]


def manifest_jobs(rows: list[ModelRow], out: Path) -> list[Job]:
    """
    Return a job for each row.

    An object whose front is unknown gets a random yaw, seeded by the file's hash, so that it is
    the same wherever the model is used.
    """
    return [Job(ObjectFolder(out, row.category, row.file.stem), partial(_load, row))
            for row in rows]


def _load(row: ModelRow) -> trimesh.Trimesh:
    mesh = load_mesh(row.file, 'y', row.front or 'z')
    if row.front is not None:
        return mesh
    rng = np.random.default_rng(int(row.sha256, 16))
    return yawed(mesh, rng.uniform(0, TURN))
