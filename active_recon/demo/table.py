"""The loop in the terminal: one row for each view, and a line with the camera's motion."""

from collections.abc import Sequence

from active_recon.geometry.cameras import Camera, whole_degrees
from active_recon.viewer.view_result import ViewResult
from rich.console import Group
from rich.table import Table
from rich.text import Text


def loop_table(title: str, views: Sequence[ViewResult], now: str) -> Group:
    """Return the table of the views so far, with the line `now` below."""
    table = Table(title=title, title_justify='left', title_style='bold')
    for heading in ('view', 'azimuth, deg', 'entropy, nats', 'expected IoU', 'at least',
                    'IoU', 'image to occupancy, ms'):
        table.add_column(heading, justify='right')
    for number, view in enumerate(views, 1):
        table.add_row(str(number), str(whole_degrees(view.camera.azimuth)),
                      _figure(view.entropy, '.0f'),
                      *(_figure(share, '.2f') for share in _judged(view)),
                      _figure(view.iou, '.3f'),
                      _figure(view.latency and 1000 * view.latency, '.0f'))
    return Group(table, Text(now, style='dim'))


def motion_line(camera: Camera | None, goal: Camera | None) -> str:
    """Return a line that says where the camera is and where its goal is."""
    if camera is None:
        return 'waiting for the camera'
    here = f'the camera is at {whole_degrees(camera.azimuth)} deg'
    return here if goal is None else f'{here}, its goal is {whole_degrees(goal.azimuth)} deg'


def _judged(view: ViewResult) -> tuple[float | None, float | None]:
    """Return the expected IoU and its lower bound."""
    quality = view.quality
    return (None, None) if quality is None else (quality.expected_iou, quality.lower_bound)


def _figure(value: float | None, form: str) -> str:
    return '' if value is None else format(value, form)
