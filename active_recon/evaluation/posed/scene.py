"""A set of objects to measure on: posed views, true voxels, views for the paper's networks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.views import no_readable, read_views, ViewSet
from active_recon.errors import ConfigError, DataError
from active_recon.evaluation.posed.walking import on_turntable, some_objects
from active_recon.models.network import ReconstructionNetwork
from active_recon.reporting import Reporting, silent
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION
import numpy as np
import torch
from torch import Tensor

IMAGE_SIZE = 128


@dataclass(frozen=True, eq=False)
class Scene:
    """
    N objects with V posed views each.

    - framed: framed images for networks that need no front, by image size, IMAGE_SIZE among them
    - truths: true voxels (N, R, R, R) bool, by R, cells a side
    - turntable: the same views for the paper's networks, by image size; empty unless the views
      are those of a turntable
    """

    framed: Mapping[int, ViewSet]
    truths: Mapping[int, Tensor]
    turntable: Mapping[int, ViewSet]

    @property
    def views(self) -> ViewSet:
        """The framed images of IMAGE_SIZE."""
        return self.framed[IMAGE_SIZE]

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.views)

    @property
    def view_count(self) -> int:
        """V, views of each object."""
        return self.views.images.shape[1]

    def shown_to(self, network: ReconstructionNetwork) -> ViewSet | None:
        """Return the views for a network; None where it cannot use them."""
        shown = self.turntable if network.needs_front else self.framed
        return shown.get(network.image_size)


def chosen_folders(folders: Sequence[ObjectFolder], category: str | None = None,
                   most: int | None = None, seed: int = 0) -> list[ObjectFolder]:
    """
    Return the objects whose category matches a pattern, e.g. `thing_*` (`!thing_*`: all others).

    At most `most` of them, drawn by the seed. Raises ConfigError where no category matches.
    """
    wanted = category or '*'
    but = wanted.startswith('!')
    kept = [folder for folder in folders
            if fnmatchcase(folder.category, wanted.removeprefix('!')) != but]
    if not kept:
        found = ', '.join(sorted({folder.category for folder in folders})[:8])
        raise ConfigError('category: no such objects: expected a pattern that some objects match, '
                          f'e.g. thing_*, got {wanted!r}; there are {found}')
    if most is not None and most < len(kept):
        rows = np.random.default_rng(seed).choice(len(kept), most, replace=False)
        kept = [kept[row] for row in sorted(rows)]
    return kept


def read_scene(folders: Sequence[ObjectFolder], networks: Sequence[ReconstructionNetwork],
               title: str = 'objects', reporting: Reporting = silent) -> Scene:
    """
    Read objects with the images and voxels that the networks need.

    If no object has voxels at 64 cells a side, only 32 are measured; objects that lack one of the
    two are left out. Raises DataError where no object can be read.
    """
    fine = any(folder.voxels_path(FINE_RESOLUTION).is_file() for folder in folders)
    resolution = FINE_RESOLUTION if fine else RESOLUTION
    with reporting(f'reading {title}', len(folders)) as advance:
        views = read_views(folders, lambda: advance(1, ''), resolution, IMAGE_SIZE, framed=True)
    truths = {}
    if fine:
        views, truths[RESOLUTION] = _with_coarse_voxels(views)
    truths[views.resolution] = views.voxels

    def again(size: int, resolution: int, framed: bool) -> ViewSet:
        what = f'reading {title} at {size} pixels'
        with reporting(what, len(views)) as advance:
            shown = read_views(views.folders, lambda: advance(1, ''), resolution, size, framed)
        if shown.folders != views.folders:
            raise DataError(f'objects missing at {size} pixels: expected those of the other '
                            f'sizes, got errors: {"; ".join(shown.unreadable[:3])}')
        return shown

    front, free = ({network.image_size for network in networks if network.needs_front == needed}
                   for needed in (True, False))
    turntable = {size: again(size, RESOLUTION, framed=False) for size in sorted(front)
                 } if on_turntable(views) else {}
    framed = {size: again(size, resolution, framed=True) for size in sorted(free - {IMAGE_SIZE})}
    return Scene({IMAGE_SIZE: views, **framed}, truths, turntable)


def _with_coarse_voxels(views: ViewSet) -> tuple[ViewSet, Tensor]:
    """Return the objects with voxels of 32 cells a side too, and these, (N, 32, 32, 32) bool."""
    kept, coarse, lacking = [], [], []
    for row, folder in enumerate(views.folders):
        try:
            coarse.append(folder.voxels(RESOLUTION).occupied(0.5))
            kept.append(row)
        except DataError as error:
            lacking.append(str(error))
    if not kept:
        raise no_readable(lacking)
    if lacking:
        views = replace(some_objects(views, torch.tensor(kept)),
                        unreadable=(*views.unreadable, *lacking))
    return views, torch.from_numpy(np.stack(coarse))
