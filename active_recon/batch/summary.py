"""The page of an archive: counts, plots, and links to the reports of the bags."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
import heapq
from html import escape
import json
from typing import Any

from active_recon.batch.rows import Row
from active_recon.cluster.stores import Place, whole
from active_recon.report.embedding import compressed, plotly_script
from active_recon.report.findings import stopped
from active_recon.report.words import counted
from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

MOST_SHOWN = 1000
"""Rows on the page, of each of the two lists; the table has all of them."""
_BINS = 20  # of IoU in [0, 1]
_FEW = 6  # counts for which an axis has a mark at every number


class Summary:
    """What is counted while rows pass; of the rows themselves only those shown are kept."""

    def __init__(self) -> None:
        self._episodes = 0
        self._stops: Counter[str] = Counter()
        self._refusals: Counter[str] = Counter()
        self._verdicts: Counter[str] = Counter()
        self._views: Counter[int] = Counter()
        self._warned = 0
        self._ious = {name: Counter[int]() for name in ('expected_iou', 'iou')}
        self._refused: list[Row] = []
        self._worst: list[tuple[float, int, Row]] = []

    def reasons(self, most: int) -> list[str]:
        """Return why bags were refused, of the first that were, each with its path."""
        return [row['refused'] for row in self._refused[:most]]

    def counting(self, rows: Iterable[Row]) -> Iterator[Row]:
        """Pass rows on, counting them."""
        for number, row in enumerate(rows):
            self._count(number, row)
            yield row

    def _count(self, number: int, row: Row) -> None:
        if row['refused']:
            self._refusals[row['refused_kind']] += 1
            if len(self._refused) < MOST_SHOWN:
                self._refused.append(row)
            return
        self._episodes += 1
        self._stops[stopped(row['stopped'])] += 1
        self._verdicts[row['verdict']] += 1
        self._views[row['views']] += 1
        self._warned += bool(row['warnings'])
        for name, bins in self._ious.items():
            if row[name] is not None:
                bins[min(int(row[name] * _BINS), _BINS - 1)] += 1
        quality = row['iou'] if row['iou'] is not None else row['expected_iou']
        entry = (-2.0 if quality is None else -quality, -number, row)
        if len(self._worst) < MOST_SHOWN:
            heapq.heappush(self._worst, entry)
        else:
            heapq.heappushpop(self._worst, entry)

    def write(self, place: Place, kind: str) -> None:
        """Write the page; raises DataError where it cannot be written."""
        environment = Environment(
            loader=ChoiceLoader([PackageLoader(f'active_recon.{room}', 'templates')
                                 for room in ('batch', 'report')]), autoescape=True,
            trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
        environment.filters['stopped'] = stopped
        refused = self._refusals.total()
        page = environment.get_template('summary.html').render(
            kind=kind, episodes=self._episodes, refused=refused, warned=self._warned,
            verdicts=[each for each in sorted(self._verdicts.items()) if each[0]],
            refused_rows=self._refused, refused_left=refused - len(self._refused),
            rows=[row for _, _, row in sorted(self._worst, key=lambda each: each[:2],
                                              reverse=True)],
            rows_left=self._episodes - len(self._worst), names=list(self._charts()),
            charts=compressed(json.dumps(self._charts(), sort_keys=True).encode()),
            plotly=plotly_script())
        with whole(place) as unfinished:
            unfinished.write_text(page, encoding='utf-8')

    def _charts(self) -> Mapping[str, dict[str, Any]]:
        """Return the plots that have something to show, by their titles."""
        middles = [(number + 0.5) / _BINS for number in range(_BINS)]
        ranges = [f'{number / _BINS:.2f} to {(number + 1) / _BINS:.2f}' for number in range(_BINS)]
        drawn: list[tuple[str, Sequence[Any], Sequence[str], list[int]]] = [
            (title, middles, ranges, [self._ious[name][number] for number in range(_BINS)])
            for title, name in (('expected IoU', 'expected_iou'), ('IoU with the truth', 'iou'))]
        for title, counts in (('views', self._views), ('why it stopped', self._stops),
                              ('why it was refused', self._refusals)):
            found = sorted(counts.items())
            # Plotly takes texts for HTML
            names = [escape(str(name), quote=False) for name, _ in found]
            drawn.append((title, names, names, [count for _, count in found]))
        return {title: _bars(title, x, names, y) for title, x, names, y in drawn if any(y)}


def _bars(title: str, x: Sequence[Any], names: Sequence[str], y: Sequence[int]) -> dict[str, Any]:
    """Return the plot of a count for each of some values, with their names in words."""
    number = 'bag' if 'refused' in title else 'episode'
    return {
        'data': [{'type': 'bar', 'x': list(x), 'y': list(y),
                  'customdata': [f'{name}: {counted(count, number)}'
                                 for name, count in zip(names, y, strict=True)],
                  'hovertemplate': '%{customdata}<extra></extra>'}],
        'layout': {'height': 260, 'margin': {'l': 58, 'r': 12, 't': 12, 'b': 44},
                   'xaxis': {'title': {'text': title}, 'fixedrange': True,
                             'type': 'category' if isinstance(x[0], str) else 'linear'},
                   'yaxis': {'title': {'text': f'{number}s'}, 'fixedrange': True,
                             **({'dtick': 1} if max(y) < _FEW else {})}}}
