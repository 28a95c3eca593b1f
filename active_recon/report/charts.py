"""
Plotly figures as plain JSON values: entropy and IoU over the views, and the time of each stage.

A colour that begins with two dashes is a variable of the page's style sheet, which has a light
and a dark scheme; the page resolves it.
"""

from collections.abc import Callable, Sequence
import math
from typing import Any

from active_recon.report.stages import STAGES, Timing
from active_recon.report.subject import Subject

Figure = dict[str, Any]
VIEW_COLORS = 6


def view_color(number: int) -> str:
    """Return the colour of a view, numbered from 1; they repeat."""
    return f'--view-{(number - 1) % VIEW_COLORS + 1}'


def entropy_chart(subjects: Sequence[Subject]) -> Figure:
    """Return the entropy after each view, with one line for each subject."""
    return _progress(subjects, 'entropy, nats', lambda subject: subject.entropies, '%{y:.0f} nats')


def iou_chart(subjects: Sequence[Subject]) -> Figure:
    """Return the IoU with the true shape after each view, with one line for each subject."""
    return _progress(subjects, 'IoU', lambda subject: subject.ious, 'IoU %{y:.3f}')


def stage_chart(timings: Sequence[Timing]) -> Figure:
    """Return the milliseconds of each stage from image to goal, with one bar for each view."""
    views = [f'view {number}' for number in range(1, len(timings) + 1)]
    return {
        'data': [{
            'type': 'bar', 'orientation': 'h', 'name': stage.name, 'y': views,
            'x': [timing.stages[index] for timing in timings],
            'marker': {'color': f'--stage-{index + 1}'},
            'hovertemplate': f'%{{y}}, {stage.name}: %{{x:.1f}} ms<extra></extra>',
        } for index, stage in enumerate(STAGES)],
        'layout': {
            'barmode': 'stack', 'height': 120 + 34 * len(views), 'bargap': 0.4,
            'margin': {'l': 56, 'r': 12, 't': 40, 'b': 44},
            'legend': {'orientation': 'h', 'x': 0, 'y': 1, 'yanchor': 'bottom',
                       'traceorder': 'normal'},
            'xaxis': {'title': {'text': 'ms after the image'}, 'fixedrange': True,
                      'rangemode': 'tozero'},
            'yaxis': {'autorange': 'reversed', 'fixedrange': True, 'showgrid': False},
        },
    }


def _progress(subjects: Sequence[Subject], title: str,
              values: Callable[[Subject], Sequence[float | None]], hover: str) -> Figure:
    several = len(subjects) > 1
    longest = max(len(subject.views) for subject in subjects)
    return {
        'data': [{
            'type': 'scatter', 'mode': 'lines+markers', 'name': subject.letter,
            'x': list(range(1, len(subject.views) + 1)), 'y': list(values(subject)),
            'line': {'color': view_color(index if several else 1), 'width': 2.5},
            # Colours repeat, and not every eye tells them apart
            'marker': {'size': 9, 'symbol': index - 1, 'color': view_color(index) if several else [
                view_color(number) for number in range(1, len(subject.views) + 1)]},
            'hovertemplate': (f'{subject.letter}, ' if several else '')
                             + f'after view %{{x}}: {hover}<extra></extra>',
        } for index, subject in enumerate(subjects, 1)],
        'layout': {
            'height': 240, 'showlegend': several,
            'margin': {'l': 58, 'r': 12, 't': 12, 'b': 44},
            'legend': {'orientation': 'h', 'x': 0, 'y': 1, 'yanchor': 'bottom'},
            'xaxis': {'title': {'text': 'after view'}, 'fixedrange': True, 'showgrid': False,
                      'tick0': 1, 'dtick': math.ceil(longest / 12), 'range': [0.6, longest + 0.4]},
            'yaxis': {'title': {'text': title}, 'fixedrange': True, 'automargin': True,
                      **({} if longest > 1 else {'rangemode': 'tozero'})},
        },
    }
