"""Reading datasets with a progress bar and a list of the objects left out."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.datasets.layout import ObjectFolder
    from active_recon.datasets.views import ViewSet
    from active_recon.geometry.canonical import NetworkSpec

Split = Annotated[str | None, typer.Option(
    '--split-file', help="ShapeNet's published split file (JSON), or 'sorted': cut the sorted ids "
                         'of each category, 70 % train, 10 % val, 20 % test. Default: whole '
                         'folders.')]


def read_objects(roots: Sequence[Path], title: str, spec: 'NetworkSpec',
                 split: str | None = None, part: str = '', at_once: bool = True,
                 depth: bool = False) -> 'ViewSet':
    """
    Read the objects of datasets into memory, at the sizes that a network needs.

    Without `at_once`, images of a network that needs no front are read when they are first used.
    With a `split`, only the objects of its `part` (train, val or test) are read. A single root
    may be the folder of PASCAL3D+, whose photographs are objects of one view each. With `depth`,
    views come with their depth images, and objects without are left out. Raises DataError where
    no object can be read, ConfigError where the network cannot use photographs.
    """
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.splits import list_split
    from active_recon.datasets.views import read_views

    if len(roots) == 1 and (roots[0] / 'Annotations').is_dir():
        return _read_photographs(roots[0], title, spec)
    folders, missing = [], []
    for root in roots:
        found, lacking = list_split(root, split, part) if split else (list_objects(root), [])
        folders += found
        missing += lacking
    with progress_bar(f'reading {title}', len(folders)) as advance:
        views = read_views(folders, lambda: advance(1, ''), spec.resolution, spec.image_size,
                           framed=not spec.needs_front, at_once=at_once, depth=depth)
    print_left_out(title, len(views), missing, views.unreadable)
    return views


def _read_photographs(root: Path, title: str, spec: 'NetworkSpec') -> 'ViewSet':
    from active_recon.datasets.pascal3d import list_photographs
    from active_recon.datasets.photographs import read_photographs

    if not spec.needs_front:
        raise ConfigError(f'{root}: photographs without camera poses: expected a network without '
                          'camera input, for example --model 2d3d-attention')
    photographs, left_out = list_photographs(root)
    with progress_bar(f'reading {title}', len(photographs)) as advance:
        views = read_photographs(photographs, left_out, lambda: advance(1, ''),
                                 spec.resolution)
    print_left_out(title, len(views), (), views.unreadable)
    return views


def print_left_out(title: str, count: int, missing: Sequence[str],
                   unreadable: Sequence[str]) -> None:
    """Print which objects of a dataset are left out, and why."""
    for reason in (*missing, *unreadable):
        typer.echo(f'left out: {reason}', err=True)
    if missing or unreadable:
        typer.echo(f'{title}: {count} read, {len(missing)} missing, {len(unreadable)} left out',
                   err=True)


def warn_of_shared_objects(training: 'Sequence[ObjectFolder]', held_out: 'Sequence[ObjectFolder]',
                           so: str) -> None:
    """Warn where validation objects are training objects, of any folder, and of what follows."""
    trained = defaultdict(list)
    for folder in training:
        trained[folder.category, folder.name].append(folder)
    shared = sum(any(map(folder.is_copy_of, trained.get((folder.category, folder.name), ())))
                 for folder in held_out)
    if shared:
        typer.echo(f'warning: {shared} of {len(held_out)} validation objects are trained on too: '
                   f'{so}', err=True)
