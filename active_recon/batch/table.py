"""The table of all rows, as Parquet."""

from collections.abc import Iterable, Iterator
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from active_recon.batch.rows import COLUMNS, Row
from active_recon.cluster.stores import Place, whole
from active_recon.errors import ConfigError

TABLE = 'table.parquet'
_GROUP = 5000  # rows that are in memory at once


def parquet() -> tuple[Any, Any]:
    """Return pyarrow and its Parquet module; raises ConfigError where it is not installed."""
    try:
        return import_module('pyarrow'), import_module('pyarrow.parquet')
    except ImportError as error:
        raise ConfigError('batch: no pyarrow here, which writes the table: expected it installed: '
                          f'pip install active_recon[batch] ({error})') from error


def write_table(rows: Iterable[Row], place: Place) -> None:
    """
    Write rows to a Parquet file, whole or not at all; the same rows give the same bytes.

    Raises as `whole`.
    """
    arrow, writing = parquet()
    types = {'string': arrow.string(), 'int32': arrow.int32(), 'double': arrow.float64(),
             'timestamp': arrow.timestamp('us', tz='UTC'), 'strings': arrow.list_(arrow.string())}
    schema = arrow.schema([(name, types[kind]) for name, (kind, _) in COLUMNS.items()])
    left = iter(rows)
    with whole(place) as unfinished, writing.ParquetWriter(
            unfinished, schema, compression='zstd') as table:
        while group := list(islice(left, _GROUP)):
            table.write_table(arrow.Table.from_pylist(group, schema))


def read_table(path: Path) -> Iterator[Row]:
    """Yield the rows of a table."""
    _, writing = parquet()
    for batch in writing.ParquetFile(path).iter_batches(_GROUP):
        yield from batch.to_pylist()
