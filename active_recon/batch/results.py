"""The result of each bag, in a file of its own, written whole."""

from dataclasses import dataclass
import hashlib
import json

from active_recon.batch.rows import Row
from active_recon.cluster.stores import Place, whole
from active_recon.json_text import json_value

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

    def write(self, out: Place, bag: Place) -> None:
        """Write the file, whole or not at all; raises as `whole`."""
        with whole(result_place(out, bag)) as unfinished:
            unfinished.write_text(json.dumps({'state': self.state, 'rows': self.rows}) + '\n',
                                  encoding='utf-8')

    @classmethod
    def read(cls, out: Place, bag: Place) -> 'BagResult | None':
        """Return the result of a bag; None where there is none, or not a whole one."""
        try:
            written = json_value(result_place(out, bag).read_text(encoding='utf-8'))
            return cls(written['state'], written['rows'])
        except (OSError, ValueError, KeyError, TypeError):
            return None


def name_of(bag: Place) -> str:
    """Return the name of a bag's files, with a folder for each 256th of them."""
    digest = hashlib.sha256(str(bag).encode('utf-8', 'surrogateescape')).hexdigest()
    return f'{digest[:2]}/{digest[2:24]}'


def result_place(out: Place, bag: Place) -> Place:
    """Return the place of a bag's result."""
    return out / _FOLDER / f'{name_of(bag)}.json'
