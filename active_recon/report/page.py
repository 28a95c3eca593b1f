"""The page: one HTML file that contains its styles, scripts and Plotly."""

from collections.abc import Sequence
from datetime import datetime, UTC
from functools import cache
import json
import math
from pathlib import Path
from typing import Any

from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import whole_degrees
from active_recon.report.charts import entropy_chart, iou_chart, stage_chart
from active_recon.report.embedding import compressed, plotly_script
from active_recon.report.findings import findings, stopped
from active_recon.report.images import data_uri
from active_recon.report.introduction import introduction
from active_recon.report.scene import scene
from active_recon.report.stages import median, STAGES, timings
from active_recon.report.subject import elevation_degrees, object_of, Subject
from active_recon.report.surface import colored_surface
from active_recon.report.turntable_map import turntable_map
from active_recon.report.words import key_words
from active_recon.whole_files import whole_file
from jinja2 import Environment, PackageLoader, StrictUndefined

MAX_SUBJECTS = 12
"""Each is drawn in 3D, and browsers limit the number of such drawings on a page."""
_IMAGE_SIDE = 320


def report_page(subjects: Sequence[Subject]) -> str:
    """
    Return the HTML page of some episodes; the same episodes give the same text.

    Raises DataError if there are none, ConfigError if there are too many for a browser.
    """
    if not subjects:
        raise DataError('no episodes with views: no image of these bags became a view')
    if len(subjects) > MAX_SUBJECTS:
        raise ConfigError(f'too many episodes for one page: expected at most {MAX_SUBJECTS}, got '
                          f'{len(subjects)}; name fewer bags, or one episode of each')
    panels = [_panel(subject) for subject in subjects]
    several = len(subjects) > 1
    known_truth = any(subject.truth is not None for subject in subjects)
    shared = {'entropy': entropy_chart(subjects), 'iou': iou_chart(subjects)}
    surfaces = [colored_surface(subject) for subject in subjects]
    for panel, surface in zip(panels, surfaces, strict=True):
        panel['colored'] = surface is not None
    drawn = {'shared': shared, 'panels': [
        {'scene': scene(subject), 'surface': surface, 'map': turntable_map(subject),
         'stages': stage_chart(timings(subject.episode, subject.timed))}
        for subject, surface in zip(subjects, surfaces, strict=True)]}
    return _environment().get_template('page.html').render(
        panels=panels, several=several, known_truth=known_truth, stages=STAGES,
        introduction=introduction(subjects),
        drawn=compressed(json.dumps(drawn, sort_keys=True, allow_nan=False).encode()),
        plotly=plotly_script())


@cache
def _environment() -> Environment:
    """Return the templates' environment, which keeps what it has compiled."""
    environment = Environment(
        loader=PackageLoader('active_recon.report', 'templates'), autoescape=True,
        trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined)
    environment.filters |= {'number': _number, 'degrees': whole_degrees,
                            'elevation': elevation_degrees, 'words': key_words}
    return environment


def write_page(page: str, path: Path) -> None:
    """Write a page atomically; raises DataError if it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as unfinished:
            # Names of files may have bytes that are not of UTF-8
            unfinished.write_text(page, encoding='utf-8', errors='replace')
    except OSError as error:
        raise DataError(f'{path}: cannot be written: {error.strerror}') from error


def _panel(subject: Subject) -> dict[str, Any]:
    """Return the template's variables of one subject."""
    run, times = subject.run, timings(subject.episode, subject.timed)
    recorded = datetime.fromtimestamp(run.begin / 1e9, UTC)
    return {
        'subject': subject,
        'object': '' if subject.of_photos else object_of(run, subject.episode),
        'policy': run.provenance.get('policy', ''),
        'recorded': f'{recorded:%Y-%m-%d %H:%M} UTC' if run.begin > 0 else '',
        'duration_s': (run.end - run.begin) / 1e9,
        'findings': findings(subject),
        'images': [data_uri(view.image, _IMAGE_SIDE) for view in subject.views],
        'entropies': subject.entropies,
        'ious': subject.ious,
        'qualities': [view.quality for view in subject.views],
        'timings': times,
        'timed': any(stage is not None for timing in times for stage in timing.stages[1:]),
        'image_to_goal_ms': median([timing.total for timing in times]),
        'travel_deg': math.degrees(subject.travel),
        'stopped': stopped(subject.end),
        'others': len(run.episodes) - 1,
    }


def _number(value: float | None, places: int = 0) -> str:
    """Return a number as text, a dash if it is unknown."""
    return '–' if value is None else f'{value:z,.{places}f}'.replace(',', '\u202f')
