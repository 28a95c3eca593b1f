"""
The turntable from above: the object, the images around it, the goals and their scores.

The unit of length is the radius of the ring of cameras. The object's front, +x, points down. A
trace with a `meta` of `{'of': k}` belongs to view k, from 0, and is shown while k is selected.
"""

from collections.abc import Sequence
import math
from typing import Any

from active_recon.bags.runs.run import RecordedGoal, RecordedView
from active_recon.geometry.cameras import (
    azimuth_difference,
    AZIMUTHS,
    Camera,
    TURN,
    VIEW_COUNT,
    whole_degrees,
)
from active_recon.geometry.view_distance import at_one_elevation, directions_of
from active_recon.report.charts import Figure, view_color
from active_recon.report.images import data_uri
from active_recon.report.subject import elevation_degrees, shown_grid, Subject
import numpy as np
from numpy.typing import NDArray

_OBJECT = 1.1  # side of the object's cube
_GOALS = 1.12
_SCORES = (1.22, 1.56)  # from the worst score to the best
_SHORTEST = 0.03  # the bar of the worst score
_THUMBNAILS = 1.95
_THUMBNAIL = 0.62
_REACH = _THUMBNAILS + _THUMBNAIL / 2 + 0.04
_TOGETHER = math.radians(8)
# A ring around the map's centre in its scale; the hole leaves the pointer to what is inside
_SCORE_RING = {
    'bgcolor': 'rgba(0,0,0,0)', 'hole': _SCORES[0] / _REACH,
    'radialaxis': {'range': [_SCORES[0], _REACH], 'visible': False},
    'angularaxis': {'rotation': -90, 'direction': 'counterclockwise', 'visible': False}}


def turntable_map(subject: Subject) -> Figure:
    """Return the map of one episode."""
    azimuths = [view.camera.azimuth for view in subject.views]
    spread = spread_out(azimuths)
    side = min(_THUMBNAIL, 0.8 * 2 * math.pi * _THUMBNAILS / max(len(azimuths), 1))
    axis = {'range': [-_REACH, _REACH], 'visible': False, 'fixedrange': True}
    data: list[dict[str, Any]] = []
    for index, view in enumerate(subject.views):
        own = [*_from_above(view, subject.threshold), *_decision(subject.goals[index])]
        data += [{**trace, 'meta': {'of': index}} for trace in own]
    data += _path(azimuths)
    data += [_goal(goal.camera, 8, '--quiet') for goal in subject.goals if goal is not None]
    data += [_camera(number, view.camera, azimuths[:number - 1])
             for number, view in enumerate(subject.views, 1)]
    return {
        'data': data,
        'layout': {
            'showlegend': False, 'margin': {'l': 0, 'r': 0, 't': 0, 'b': 0}, 'dragmode': False,
            'polar': _SCORE_RING,
            'xaxis': axis, 'yaxis': {**axis, 'scaleanchor': 'x'},
            'images': [_thumbnail(view.image, at, side)
                       for view, at in zip(subject.views, spread, strict=True)],
            'shapes': [
                {'type': 'circle', 'x0': -1, 'x1': 1, 'y0': -1, 'y1': 1, 'layer': 'below',
                 'line': {'color': '--rule', 'width': 1.5}, 'fillcolor': '--plate'},
                *(_leader(number, azimuth, at) for number, (azimuth, at) in enumerate(
                    zip(azimuths, spread, strict=True), 1)),
                *(_frame(number, at, side) for number, at in enumerate(spread, 1))],
            'annotations': [{'x': 0, 'y': -0.67, 'text': 'front ▾', 'showarrow': False,
                             'font': {'size': 11, 'color': '--quiet'}}],
        },
    }


def place(azimuth: float, radius: float) -> tuple[float, float]:
    """Return x to the right and y up of a point on the map."""
    return radius * math.sin(azimuth), -radius * math.cos(azimuth)


def spread_out(azimuths: Sequence[float]) -> list[float]:
    """Return azimuths (radians) near those given, moved apart so that images do not overlap."""
    apart = min(math.radians(27), 2 * math.pi / max(len(azimuths), 1))
    spread = np.array(azimuths, np.float64)
    for _ in range(400):
        away = azimuth_difference(spread[:, None], spread)
        # Of two at one place the later gives way counter-clockwise
        earlier = np.tri(len(spread), k=-1, dtype=bool)
        sign = np.where(away == 0, np.where(earlier, 1, -1), np.sign(away))
        push = np.maximum(apart - np.abs(away), 0)
        np.fill_diagonal(push, 0)
        if push.max(initial=0) < 1e-3:
            break
        spread += 0.25 * (sign * push).sum(axis=1)
    return [float(azimuth) for azimuth in spread]


def _from_above(view: RecordedView, threshold: float) -> list[dict[str, Any]]:
    grid = shown_grid(view)
    if grid is None:
        return []
    seen: NDArray[np.bool_] = np.asarray(grid.occupied(threshold).any(axis=2))
    across = ((np.arange(len(seen)) + 0.5) / len(seen) - 0.5) * _OBJECT
    return [{
        'type': 'heatmap', 'z': seen.astype(int).tolist(), 'x': across.tolist(),
        'y': (-across).tolist(), 'zmin': 0, 'zmax': 1, 'showscale': False, 'hoverinfo': 'skip',
        'colorscale': [[0, 'rgba(0,0,0,0)'], [1, '--object']],
    }]


def _decision(goal: RecordedGoal | None) -> list[dict[str, Any]]:
    """
    Return the goal, and a bar for each candidate that is longer for a better score.

    Where the candidates' elevations differ by more than 10 degrees, a bar stands for the best of
    those nearest to one of 24 azimuths.
    """
    if goal is None:
        return []
    chosen = _goal(goal.camera, 15, '--goal')
    if goal.candidates is None or goal.scores is None:
        return [chosen]
    finite = (np.isfinite(goal.scores) & np.isfinite(goal.candidates.azimuths)
              & np.isfinite(goal.candidates.positions).all(axis=1))
    if not finite.any():
        return [chosen]
    positions, scores = goal.candidates.positions[finite], goal.scores[finite].astype(np.float64)
    azimuths = goal.candidates.azimuths[finite]
    elevations = np.arctan2(positions[:, 2], np.hypot(positions[:, 0], positions[:, 1]))
    around = azimuths
    if not at_one_elevation(directions_of(positions)):
        sectors, best = _best_of_sectors(azimuths, scores)
        azimuths, elevations, scores = azimuths[best], elevations[best], scores[best]
        around = AZIMUTHS[sectors]
    shares = (scores - scores.min()) / (np.ptp(scores) or 1.0)
    gaps = np.diff(np.unique(around), append=around.min() + TURN)
    return [{
        'type': 'barpolar', 'theta': np.degrees(around).tolist(), 'base': _SCORES[0],
        'r': (_SHORTEST + shares * (_SCORES[1] - _SCORES[0])).tolist(),
        'width': math.degrees(0.8 * min(TURN / VIEW_COUNT, gaps.min())),
        'marker': {'color': '--score', 'line': {'width': 0}},
        'text': [f'{_words(*place)}: score {score:.4g}' for *place, score in zip(
            azimuths.tolist(), elevations.tolist(), scores.tolist(), strict=True)],
        'hovertemplate': '%{text}<extra></extra>'}, chosen]


def _best_of_sectors(azimuths: NDArray[np.float64], scores: NDArray[np.float64]
                     ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which of the 24 azimuths have candidates near them, and the best one's index each."""
    sectors = np.rint(azimuths * VIEW_COUNT / TURN).astype(np.int64) % VIEW_COUNT
    order = np.lexsort((-scores, sectors))
    found, first = np.unique(sectors[order], return_index=True)
    return found, order[first]


def _words(azimuth: float, elevation: float) -> str:
    return f'{whole_degrees(azimuth)}°, elevation {elevation_degrees(elevation)}°'


def _path(azimuths: Sequence[float]) -> list[dict[str, Any]]:
    points = [place(azimuth, 0.93) for azimuth in azimuths]
    return [{
        'type': 'scatter', 'mode': 'lines+markers', 'hoverinfo': 'skip',
        'x': [point[0] for point in points], 'y': [point[1] for point in points],
        'line': {'color': '--quiet', 'width': 1.2, 'dash': 'dot'},
        'marker': {'symbol': 'arrow', 'angleref': 'previous', 'size': 9, 'color': '--quiet'},
    }] if len(points) > 1 else []


def _goal(camera: Camera, size: int, color: str) -> dict[str, Any]:
    x, y = place(camera.azimuth, _GOALS)
    return {'type': 'scatter', 'mode': 'markers', 'x': [x], 'y': [y], 'cliponaxis': False,
            'marker': {'symbol': 'diamond-open', 'size': size, 'color': color,
                       'line': {'width': 2}},
            'hovertemplate': f'goal at {_words(camera.azimuth, camera.elevation)}<extra></extra>'}


def _camera(number: int, camera: Camera, earlier: Sequence[float]) -> dict[str, Any]:
    again = int((np.abs(azimuth_difference(earlier, camera.azimuth)) < _TOGETHER).sum())
    x, y = place(camera.azimuth, 1 - 0.17 * min(again, 4))
    return {'type': 'scatter', 'mode': 'markers+text', 'x': [x], 'y': [y], 'text': [str(number)],
            'textfont': {'color': '--on-view', 'size': 12},
            'marker': {'size': 22, 'color': view_color(number)},
            'hovertemplate': (f'view {number} at {_words(camera.azimuth, camera.elevation)}'
                              '<extra></extra>')}


def _leader(number: int, azimuth: float, at: float) -> dict[str, Any]:
    (x0, y0), (x1, y1) = place(azimuth, 1.0), place(at, _THUMBNAILS)
    return {'type': 'line', 'x0': x0, 'y0': y0, 'x1': x1, 'y1': y1, 'layer': 'below',
            'line': {'color': view_color(number), 'width': 1.2}}


def _thumbnail(image: NDArray[np.uint8], at: float, side: float) -> dict[str, Any]:
    x, y = place(at, _THUMBNAILS)
    return {'source': data_uri(image, 160), 'xref': 'x', 'yref': 'y', 'x': x, 'y': y,
            'sizex': side, 'sizey': side, 'xanchor': 'center', 'yanchor': 'middle',
            'sizing': 'contain', 'layer': 'above'}


def _frame(number: int, at: float, side: float) -> dict[str, Any]:
    x, y = place(at, _THUMBNAILS)
    return {'type': 'rect', 'x0': x - side / 2, 'x1': x + side / 2, 'y0': y - side / 2,
            'y1': y + side / 2, 'line': {'color': view_color(number), 'width': 2.5}}
