"""What was measured last, by parts: docs/results/benchmarks.json, and the table that shows it."""

from collections.abc import Iterator, Mapping, Sequence
import json
from pathlib import Path
import re
from typing import Any

from benchmarks.figures import Figure, machine

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs' / 'results' / 'benchmarks.json'
DOCUMENT = ROOT / 'doc' / 'benchmarks.md'
HEAD = ('| figure | measured | 5 to 95 % | goal | x reference |', '|---|---|---|---|---|')
_TABLE = re.compile(r'(<!-- bench: begin -->\n).*?(<!-- bench: end -->)', re.DOTALL)
_MS = {'ms': 1.0, 's': 1e3}

Record = Mapping[str, Mapping[str, Any]]
"""By the name of each part, its `machine`, `reference_ms` and `figures`."""


def part_record(figures: Sequence[Figure], reference: float) -> dict[str, Any]:
    """Return what is kept of a part that was measured beside a reference, milliseconds."""
    return {'machine': machine(), 'reference_ms': reference, 'figures': [
        {'name': figure.name, 'unit': figure.unit, 'value': figure.value,
         'percentile': figure.percentile, 'low_high': figure.spread, 'goal': figure.goal,
         'more_is_better': figure.more_is_better, 'reached': figure.reached,
         'samples': len(figure.samples)} for figure in figures]}


def keep(new: Record, order: Sequence[str], by_themselves: Sequence[str]) -> list[str]:
    """
    Write parts in the place of what was measured of them before, and the document's table.

    Return the parts that stay beside them and were not measured on this machine, as far as known.
    """
    known = {**json.loads(RESULTS.read_text())['parts'], **new}
    parts = {name: known[name] for name in order if name in known}
    RESULTS.write_text(json.dumps({'command': 'make bench', 'parts': parts}, indent=1) + '\n')
    DOCUMENT.write_text(with_table(DOCUMENT.read_text(), parts, by_themselves))
    return [name for name, part in parts.items() if part.get('machine') != machine()]


def with_table(text: str, parts: Record, by_themselves: Sequence[str]) -> str:
    """Return a document with the table between its marks made anew from a record."""
    rows = [row(each, part['reference_ms'], _how(name) if name in by_themselves else '')
            for name, part in parts.items() for each in part['figures']]
    return _TABLE.sub(lambda found: found[1] + '\n'.join([*HEAD, *rows]) + '\n' + found[2], text)


def rows(part: Mapping[str, Any]) -> Iterator[str]:
    """Yield a Markdown row for each figure of a part."""
    return (row(each, part['reference_ms']) for each in part['figures'])


def row(figure: Mapping[str, Any], reference: float, how: str = '') -> str:
    """Return the Markdown row of a figure, and how it is measured beside its name."""
    low, high = figure['low_high']
    goal = ''
    if figure['goal'] is not None:
        goal = (f'{"at least" if figure["more_is_better"] else "at most"} {figure["goal"]:g} '
                f'{figure["unit"]}{"" if figure["reached"] else ": missed"}')
    ratio = (f'{figure["value"] * _MS[figure["unit"]] / reference:.1f}'
             if figure['unit'] in _MS else '')
    return (f'| {figure["name"]}{how} | {_digits(figure["value"])} {figure["unit"]} '
            f'| {_digits(low)} to {_digits(high)} | {goal} | {ratio} |')


def _how(part: str) -> str:
    return f' (`python -m benchmarks {part}`, by itself)'


def _digits(value: float) -> str:
    return f'{value:.0f}' if value >= 100 else f'{value:.3g}'
