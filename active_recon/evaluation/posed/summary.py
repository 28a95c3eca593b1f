"""Means and intervals of the measured values, ready for JSON, and tables in Markdown."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from active_recon.evaluation.calibration import calibration_error
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.measuring import Measured
from active_recon.evaluation.posed.robustness import Found, YAWS
from active_recon.evaluation.posed.scoring import Scores
from active_recon.evaluation.statistics import difference, Interval, mean_interval
from active_recon.volumes.voxels import FINE_RESOLUTION
import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]
Figure = dict[str, float] | None
"""Mean, low, high (95 % over objects), number of objects; None where nothing was measured."""


def figure(values: Values, others: Values | None = None) -> Figure:
    """Return mean and interval of values (N,), or of values minus others, paired; NaN: missing."""
    there = np.isfinite(values) if others is None else np.isfinite(values) & np.isfinite(others)
    if not there.any():
        return None
    found: Interval = (mean_interval(values[there]) if others is None
                       else difference(values[there], others[there]))
    return {**asdict(found), 'objects': int(there.sum())}


def entrant_figures(entrant: Entrant, measured: Measured) -> dict[str, Any]:
    """Return all figures of an entrant: by kind of views and name, one for each count."""
    return {
        'weights': entrant.weights, 'chosen_on': entrant.chosen_on,
        'thresholds': {str(side): entrant.thresholds[side] for side in entrant.sides},
        'temperatures': {str(count): at for count, at in entrant.temperatures.items()},
        'grid_temperatures': {str(count): at
                              for count, at in entrant.grid_temperatures.items()},
        **{kind: {name: [figure(of_count) for of_count in values.T]
                  for name, values in of_kind.items()}
           for kind, of_kind in measured.values.items()},
        'own_ahead': _own_ahead(measured.values.get('random', {})),
        'calibration': {name: [calibration_error(diagram) for diagram in diagrams]
                        for name, diagrams in measured.diagrams.items()}}


def _own_ahead(values: Mapping[str, Values]) -> dict[str, list[Figure]]:
    """Return the gain of a threshold for each object over the fixed one, by name."""
    return {name: [figure(*pair) for pair in zip(own.T, values[f'iou_{name.rpartition("_")[2]}'].T,
                                               strict=True)]
            for name, own in values.items() if 'own_iou_' in name}


def ahead_figures(first: Measured, other: Measured) -> dict[str, Any]:
    """Return the paired differences of the first entrant minus another, where both have values."""
    return {kind: {name: [figure(*pair) for pair in zip(values.T, other.values[kind][name].T,
                                                      strict=True)]
                   for name, values in of_kind.items() if name in other.values[kind]}
            for kind, of_kind in first.values.items() if kind in other.values}


def baseline_figures(rows: Sequence[Scores]) -> dict[str, Figure]:
    """Return the figures of scores of objects, by name."""
    return {name: figure(np.array([row.get(name, np.nan) for row in rows]))
            for name in sorted({name for row in rows for name in row})}


def robustness_figures(found: Iterable[Found]) -> dict[str, Any]:
    """
    Return for each disturbance and score the disturbed and clean figures and their difference.

    `yaw` has for each score the means at all yaws and their spread, greatest minus least;
    `quarters` is the spread of quarter turns only, which need no interpolation.
    """
    by_name: dict[str, list[Found]] = {}
    for each in found:
        by_name.setdefault(each.name, []).append(each)
    rows = {name: _beside(each) for name, each in by_name.items()}
    yaws = {name: rows.pop(name) for name in sorted(by_name) if name.startswith('yaw ')}
    spread: dict[str, Any] = {}
    for score in next(iter(yaws.values()), {}):
        means = [row[score]['figure']['mean'] for row in yaws.values()]
        quarters = means[::YAWS // 4]
        spread[score] = {'objects': len(by_name[next(iter(yaws))]), 'by_yaw': means,
                         'spread': max(means) - min(means),
                         'quarters': max(quarters) - min(quarters)}
    return {'disturbances': rows, 'yaw': spread}


def _beside(found: Sequence[Found]) -> dict[str, Any]:
    result = {}
    for name in found[0].disturbed:
        own, clean = (np.array([each[name] for each in part]) for part in (
            [one.disturbed for one in found], [one.clean for one in found]))
        result[name] = {'figure': figure(own), 'clean': figure(clean),
                        'change': figure(own, clean)}
    return result


def markdown(result: Mapping[str, Any]) -> str:
    """Return a Markdown document with all tables of a study's result."""
    parts = ['# Measured on posed views', f'`{result["command"]}`',
             'Means with 95 % intervals over objects; "of N": of so many objects alone, since the '
             'others have none, such as thin parts.']
    for figures in result.get('sets', []):
        parts += _set_tables(figures)
    if 'photographs' in result:
        parts += _photograph_tables(result['photographs'])
    return '\n\n'.join(parts) + '\n'


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown, with right-aligned columns but the first."""
    lines = [header, [':--', *['--:'] * (len(header) - 1)], *rows]
    return '\n'.join('| ' + ' | '.join(line) + ' |' for line in lines)


def _set_tables(figures: Mapping[str, Any]) -> list[str]:
    counts, models = [str(count) for count in figures['counts']], figures['models']
    cell = partial(_cell, objects=figures['objects'])
    parts = [f'## {figures["data"]}', f'{figures["objects"]} objects of {figures["views"]} views.']
    parts += [f'{name} is left out: {why}.' for name, why in figures['left_out'].items()]
    if others := [name for name, own in models.items() if 'brier' not in own.get('random', {})]:
        finest, lacking = figures['cells'][0], FINE_RESOLUTION not in figures['cells']
        parts += [f'Without thin parts, precision, recall and calibration: {", ".join(others)}. '
                  f'They are measured at the finest true voxels, {finest} cells a side'
                  f'{f" (`--fine` makes {FINE_RESOLUTION})" if lacking else ""}, of networks with '
                  'as many.']
    for kind in ('random', 'even'):
        for side in (64, 32):
            rows = _rows(models, kind, f'iou_{side}', cell)
            for name, values in figures.get('baselines', {}).items():
                if kind == 'random' and f'iou_{side}' in values:
                    rows.append([name, cell(values[f'iou_{side}']),
                                 *['-'] * (len(counts) - 1)])
            for name, ahead in figures['ahead'].items():
                rows += [[f'ahead of {name}', *map(cell, ahead[kind][f'iou_{side}'])]
                         ] if f'iou_{side}' in ahead.get(kind, {}) else []
            if rows:
                parts += [f'### IoU at {side} cells, {kind} views', table(['views', *counts],
                                                                          rows)]
    for name, title in (
            ('filled_iou_64', 'IoU at 64 cells, true cells that no camera can tell filled'),
            ('filled_iou_32', 'IoU at 32 cells, true cells that no camera can tell filled'),
            ('f_score_1', 'F-score at 1 % of the cube'), ('f_score_2', 'F-score at 2 %'),
            ('chamfer', 'Chamfer distance, sides of the cube'),
            ('normal_consistency', 'Normal consistency'), ('thin_recall', 'Recall of thin parts'),
            ('precision', 'Precision at the finest cells'),
            ('recall', 'Recall at the finest cells'),
            ('own_iou_64', 'IoU at 64 cells at the threshold of each object'),
            ('own_iou_32', 'IoU at 32 cells at the threshold of each object'),
            ('expected_iou', 'IoU that the network expects there'),
            ('tempered_own_iou_64', 'IoU at 64 cells at the threshold of each object, under '
                                    'temperatures'),
            ('tempered_own_iou_32', 'IoU at 32 cells at the threshold of each object, under '
                                    'temperatures'),
            ('tempered_expected_iou', 'IoU that the network expects there, under temperatures'),
            ('brier', 'Brier score near the surface'),
            ('tempered_brier', 'Brier score near the surface, under temperatures')):
        if rows := _rows(models, 'random', name, cell):
            rows += [[f'{model}, ahead of a fixed one', *map(cell, own['own_ahead'][name])]
                     for model, own in models.items() if name in own['own_ahead']]
            parts += [f'### {title}', table(['random views', *counts], rows)]
    errors = [[f'{model}{" under temperatures" * name.startswith("tempered")}',
               *(f'{value:.3f}' for value in values)]
              for model, own in models.items() for name, values in own['calibration'].items()]
    if errors:
        parts += ['### Expected calibration error near the surface',
                  table(['random views', *counts], errors)]
    return parts + _robustness_tables(figures.get('robustness', {}))


def _rows(models: Mapping[str, Any], kind: str, name: str,
          cell: Callable[[Figure], str]) -> list[list[str]]:
    return [[model, *map(cell, own[kind][name])] for model, own in models.items()
            if name in own.get(kind, {})]


def _robustness_tables(figures: Mapping[str, Any]) -> list[str]:
    rows = [[f'{model}, {name}', side.removeprefix('iou_'), str(values['clean']['objects']),
             *(_cell(values[part]) for part in ('clean', 'figure', 'change'))]
            for model, own in figures.items() for name, sides in own['disturbances'].items()
            for side, values in sides.items()]
    rows += [[f'{model}, {len(values["by_yaw"])} yaws', side.removeprefix('iou_'),
              str(values['objects']), f'{values["by_yaw"][0]:.3f}',
              f'{min(values["by_yaw"]):.3f} to {max(values["by_yaw"]):.3f}',
              f'spread {values["spread"]:.3f}, of quarter turns {values["quarters"]:.3f}']
             for model, own in figures.items() for side, values in own['yaw'].items()]
    header = ['what', 'cells', 'objects', 'clean', 'disturbed', 'change']
    return ['### Disturbed views', table(header, rows)] if rows else []


def _photograph_tables(figures: Mapping[str, Any]) -> list[str]:
    steps = [str(step + 1) for step in range(len(figures['views']))]
    rows = [["the silhouettes' hull", *_of_starts(figures['hull'])]]
    rows += [[f'{model}, {background}', *_of_starts(values)]
             for model, own in figures['models'].items() for background, values in own.items()
             if background != 'threshold']
    left_out = [f'{name} is left out: {why}.' for name, why in figures['left_out'].items()]
    return [f'## Photographs: {figures["folder"]}', *left_out,
            f'IoU at 32 cells with the hull of all {figures["photographs"]} silhouettes '
            f'({figures["cells"]} cells), of even views from the first photograph on; in brackets '
            'the least and the greatest over all first photographs.',
            table(['views', *steps], rows)]


def _of_starts(values: Mapping[str, Sequence[float]]) -> list[str]:
    return [f'{own:.3f} [{low:.3f}, {high:.3f}]' for own, low, high in zip(
        values['iou'], values['least'], values['greatest'], strict=True)]


def _cell(values: Figure, objects: int = 0) -> str:
    """Return a figure in words, and of how many objects it is where that is fewer than all."""
    if values is None:
        return '-'
    few = f' of {values["objects"]}' if values['objects'] < objects else ''
    return f'{values["mean"]:.3f} [{values["low"]:.3f}, {values["high"]:.3f}]{few}'
