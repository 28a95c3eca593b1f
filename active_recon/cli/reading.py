"""Datasets read with a progress bar; what was left out is told."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.progress import progress_bar
import typer

if TYPE_CHECKING:
    from active_recon.datasets.views import ViewSet

Split = Annotated[str | None, typer.Option(
    '--split-file', help="ShapeNet's published split file (JSON), or 'sorted': the sorted ids of "
                         'each category, the last fifth for the test. Default: whole folders.')]


def read_objects(roots: Sequence[Path], title: str, resolution: int = 32,
                 split: str | None = None, part: str = '') -> 'ViewSet':
    """
    Read the objects of some datasets into memory, their truth with so many cells a side.

    With a `split`, only those of its `part` (train, val or test).
    """
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.splits import list_split
    from active_recon.datasets.views import read_views

    folders, missing = [], []
    for root in roots:
        found, lacking = list_split(root, split, part) if split else (list_objects(root), [])
        folders += found
        missing += lacking
    with progress_bar(f'reading {title}', len(folders)) as advance:
        views = read_views(folders, lambda: advance(1, ''), resolution)
    for refusal in (*missing, *views.unreadable):
        typer.echo(f'left out: {refusal}', err=True)
    if missing or views.unreadable:
        typer.echo(f'{title}: {len(views)} objects read, {len(missing)} missing, '
                   f'{len(views.unreadable)} unreadable', err=True)
    return views
