"""The result of a part of the paper: tables, claims and an image."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from active_recon.errors import ConfigError
from active_recon.evaluation.statistics import Interval
import numpy as np
from numpy.typing import NDArray

PUBLISHED = 'published'
Cell = Interval | float | int | str | None


@dataclass(frozen=True)
class Column:
    """
    A column of a table; None is a cell that was not measured.

    `published` marks the paper's own values, which its heading states with the dataset that they
    are `of`. Raises ConfigError where published and measured values are mixed.
    """

    heading: str
    cells: Sequence[Cell]
    published: bool = False
    of: str = 'ShapeNet'

    def __post_init__(self) -> None:
        """Reject measured values under a published heading, and the reverse."""
        intervals = any(isinstance(cell, Interval) for cell in self.cells)
        if self.heading.startswith(PUBLISHED) or (self.published and intervals):
            raise ConfigError(f'{self.heading}: published and measured figures in one column: '
                              'expected each in columns of their own')

    @property
    def title(self) -> str:
        """The column's heading in the table."""
        if not self.published:
            return self.heading
        return ': '.join(filter(None, (f'{PUBLISHED}, {self.of}', self.heading)))


@dataclass(frozen=True)
class Table:
    """
    A table, whose first column has the heading `key` and the rows' names.

    Numbers are printed with `digits` decimals. Raises ConfigError where a column has the wrong
    length.
    """

    title: str
    key: str
    rows: Sequence[str]
    columns: Sequence[Column]
    digits: int = 3

    def __post_init__(self) -> None:
        """Reject columns of another length."""
        for column in self.columns:
            if len(column.cells) != len(self.rows):
                raise ConfigError(f'{self.title}: wrong number of cells: expected '
                                  f'{len(self.rows)} in the column {column.heading!r}, got '
                                  f'{len(column.cells)}')

    def markdown(self) -> str:
        """Return the table in Markdown."""
        lines = [[self.key, *(column.title for column in self.columns)],
                 ['---'] + ['---:'] * len(self.columns)]
        lines += [[name, *(self._formatted(column.cells[row]) for column in self.columns)]
                  for row, name in enumerate(self.rows)]
        return '\n'.join(f'| {" | ".join(line)} |' for line in lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the table for JSON."""
        return {'title': self.title, 'rows': list(self.rows), 'columns': [
            {'heading': column.title, 'published': column.published,
             'cells': [plain(cell) for cell in column.cells]} for column in self.columns]}

    def _formatted(self, cell: Cell) -> str:
        match cell:
            case None:
                return '–'
            case str():
                return cell
            case Interval():
                return format_interval(cell, self.digits)
            case int():
                return f'{cell:,}'
        return f'{cell:.{self.digits}f}'


@dataclass(frozen=True)
class Claim:
    """A claim of the paper or a target, the verdict on it, and the values that decide it."""

    claim: str
    verdict: str
    because: str

    def markdown(self) -> str:
        """Return the claim as an item of a list."""
        return f'- {self.claim}: **{self.verdict}**. {self.because}'


@dataclass(frozen=True, eq=False)
class Result:
    """
    The result of a part.

    `text` describes the measurement; `figures` are values that other parts use, ready for JSON;
    `picture` is (H, W, 3) uint8 RGB.
    """

    title: str
    text: str
    tables: Sequence[Table]
    claims: Sequence[Claim]
    picture: NDArray[np.uint8]
    figures: Mapping[str, Any] = field(default_factory=dict)


def format_interval(spread: Interval, digits: int = 3) -> str:
    """Return a mean with its interval as text: mean [low, high]."""
    return f'{spread.mean:.{digits}f} [{spread.low:.{digits}f}, {spread.high:.{digits}f}]'


def counted(count: int, thing: str = 'view') -> str:
    """Return a number of views, or of other things, with their noun."""
    return f'{count} {thing}{"s" * (count > 1)}'


def plain(cell: Cell) -> Any:
    """Return a cell for JSON."""
    return asdict(cell) if isinstance(cell, Interval) else cell
