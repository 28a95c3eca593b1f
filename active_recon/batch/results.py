"""The result of each bag, in a file of its own, written whole."""

from dataclasses import dataclass
import hashlib
import json
from pathlib import Path

from active_recon.batch.rows import Row
from active_recon.whole_files import whole_file

_FOLDER = 'results'


@dataclass(frozen=True)
class BagResult:
    """
    The rows of a bag.

    `state` names the bag's files and the options that they are of; '' where a second start is to
    try again.
    """

    state: str
    rows: list[Row]

    @property
    def refused(self) -> bool:
        """Whether the bag has no result."""
        return bool(self.rows[0]['refused'])

    def write(self, out: Path, bag: Path) -> None:
        """Write the file, whole or not at all; raises OSError where there is no room."""
        path = result_path(out, bag)
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as unfinished:
            unfinished.write_text(json.dumps({'state': self.state, 'rows': self.rows}) + '\n',
                                  encoding='utf-8')

    @classmethod
    def read(cls, out: Path, bag: Path) -> 'BagResult | None':
        """Return the result of a bag; None where there is none, or not a whole one."""
        try:
            written = json.loads(result_path(out, bag).read_text(encoding='utf-8'))
            return cls(written['state'], written['rows'])
        except (OSError, ValueError, KeyError, TypeError):
            return None


def name_of(bag: Path) -> str:
    """Return the name of a bag's files, with a folder for each 256th of them."""
    digest = hashlib.sha256(str(bag).encode('utf-8', 'surrogateescape')).hexdigest()
    return f'{digest[:2]}/{digest[2:24]}'


def result_path(out: Path, bag: Path) -> Path:
    """Return the path of a bag's result."""
    return out / _FOLDER / f'{name_of(bag)}.json'
