"""The loop in the terminal: one row for each view, and what happens now."""

from collections.abc import Sequence
import math

from active_recon.geometry.cameras import Camera
from active_recon.seen_view import SeenView
from rich.console import Group
from rich.table import Table
from rich.text import Text


def loop_table(title: str, views: Sequence[SeenView], now: str) -> Group:
    """Return the rows so far with the line `now` beneath."""
    table = Table(title=title, title_justify='left', title_style='bold')
    for heading in ('view', 'azimuth, deg', 'entropy, nats', 'IoU', 'image to occupancy, ms'):
        table.add_column(heading, justify='right')
    for view in views:
        table.add_row(str(view.number), f'{math.degrees(view.azimuth):.0f}',
                      f'{view.entropy:.0f}', f'{view.iou:.3f}', f'{1000 * view.latency:.0f}')
    return Group(table, Text(now, style='dim'))


def turning(azimuth: float | None, goal: Camera | None) -> str:
    """Return where the camera is (radians) and where it goes as a line for people."""
    if azimuth is None:
        return 'waiting for the camera'
    here = f'the camera is at {math.degrees(azimuth):.0f} deg'
    return here if goal is None else f'{here}, its goal is {math.degrees(goal.azimuth):.0f} deg'
