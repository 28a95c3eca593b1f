"""Objects that are made while a training learns from those that are ready."""

from collections.abc import Callable
from dataclasses import dataclass
import hashlib
import json
import math
import threading
import time
from types import TracebackType
from typing import Any, Self

from active_recon.config import Config
from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.made_ahead import MadeAhead
from active_recon.datasets.recipes import Made, Maker, ROOT
from active_recon.datasets.views import ViewSet
from active_recon.errors import ConfigError
from active_recon.shapes import generators_hash
import numpy as np
import torch
from torch import Tensor

_STEPS_AT_ONCE = 20  # that several threads draw at the same time, from the first to the last


@dataclass(frozen=True)
class Pace(Config):
    """
    How many objects there are: a step draws from the newest `kept` of `first + step * per_step`.

    An object takes 1.2 MB of memory at 128 pixels, 64 cells and 12 views. Raises ConfigError on
    numbers that leave nothing to draw.
    """

    first: int
    per_step: float
    kept: int

    def __post_init__(self) -> None:
        """Reject what leaves nothing to draw."""
        if min(self.first, self.kept) < 1 or not 0 <= self.per_step < math.inf:
            raise ConfigError('Pace: number too small: expected 1 or more objects at first and '
                              f'kept, and 0 or more at each step, got {self.to_dict()}')

    def drawn_at(self, step: int) -> range:
        """Return the numbers of the objects that a step draws from."""
        made = self.first + int(step * self.per_step)
        return range(max(0, made - self.kept), made)


class MadeObjects:
    """
    The objects of a maker, of which each step of a training draws from those that its pace tells.

    They depend on the maker, the pace and the step alone, not on how fast they are made: a
    training waits for those that are not ready. So it can be interrupted; resumed, it makes those
    again that are still drawn. Each of `world` processes that train together makes its own, in
    `workers` processes. `left_out` is called once with the name of each object that cannot be
    made, and why. `waited` are the seconds in which a step had to wait. A context: what makes
    objects ends with it.
    """

    def __init__(self, maker: Maker, pace: Pace, workers: int, rank: int = 0, world: int = 1,
                 left_out: Callable[[str], None] = lambda reason: None) -> None:
        self._maker, self._pace, self._workers = maker, pace, workers
        self._rank, self._world = rank, world
        self._tell, self._told = left_out, set[str]()
        self._ahead: MadeAhead | None = None
        self._lock = threading.Lock()
        self._made = 0
        # Steps that are drawn at the same time do not draw from the same objects
        self._places = pace.kept + math.ceil(_STEPS_AT_ONCE * pace.per_step) + 1
        self._rows: dict[str, Tensor] = {}
        self._folders: dict[int, ObjectFolder] = {}
        self.waited = 0.0

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the recipe, the pace, the names of the meshes and the generators' code."""
        told = {'recipe': self._maker.recipe.to_dict(), 'pace': self._pace.to_dict(),
                'meshes': self.meshes, 'generators': generators_hash()}
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()

    @property
    def meshes(self) -> list[str]:
        """The categories and names of the mesh files, CATEGORY/NAME."""
        return [job.folder.full_name for job in self._maker.meshes]

    @property
    def made(self) -> int:
        """How many objects there were until now, in all processes that train together."""
        return self._made * self._world

    @property
    def card(self) -> dict[str, Any]:
        """What a card of weights tells of the data."""
        return {'made in training': self.made,
                'recipe': self._maker.recipe.to_dict(), 'mesh files': len(self.meshes)}

    def lacking(self, step: int) -> int:
        """Return how many objects are still to be made before a step can draw."""
        return self._pace.drawn_at(step).stop - max(self._made, self._first(step))

    def at(self, step: int, ready: Callable[[], None] = lambda: None) -> ViewSet:
        """
        Return the objects that a step draws from; waits for those that are not ready.

        Calls `ready` for each that it waited for. A step may be at most 20 before the last that
        was asked for. Raises as `MadeAhead.take` does.
        """
        with self._lock:
            drawn = self._pace.drawn_at(step)
            begun = time.monotonic()
            while self._made < drawn.stop or self._ahead is None:
                self._make_one(step)
                ready()
            self.waited += time.monotonic() - begun
            places = torch.arange(drawn.start, drawn.stop) % self._places
            rows: dict[str, Any] = {name: _Rows(part, places)
                                    for name, part in self._rows.items()}
            return ViewSet(rows['images'], self._rows['poses'][places],
                           self._rows['intrinsics'][places], rows['voxels'],
                           tuple(self._folders[place] for place in places.tolist()),
                           seen=rows['seen'])

    def __enter__(self) -> Self:
        """Make objects until the block ends."""
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None,
                 trace: TracebackType | None) -> None:
        """End the processes that make objects."""
        if self._ahead:
            self._ahead.close()

    def _first(self, step: int) -> int:
        """Return the number of the oldest object that steps draw from at the same time."""
        return self._pace.drawn_at(max(0, step - _STEPS_AT_ONCE)).start

    def _make_one(self, step: int) -> None:
        """Keep one object more; a resumed training begins with the oldest that it draws."""
        if self._ahead is None:
            self._made = self._first(step)
            self._ahead = MadeAhead(
                self._maker, self._workers, self._workers + math.ceil(2 * self._pace.per_step),
                self._made * self._world + self._rank, self._world)
        made, place = self._ahead.take(), self._made % self._places
        for name, part in _parts(made).items():
            if name not in self._rows:
                self._rows[name] = torch.from_numpy(
                    np.empty((self._places, *part.shape), part.dtype))
            self._rows[name][place] = torch.from_numpy(part)
        self._folders[place] = ObjectFolder(ROOT, made.category, made.name)
        for reason in made.left_out:
            if reason not in self._told:
                self._told.add(reason)
                self._tell(reason)
        self._made += 1


class _Rows:
    """Some rows of a tensor that is not copied; indexed as `OnDemand` is."""

    def __init__(self, whole: Tensor, places: Tensor) -> None:
        self._whole, self._places = whole, places
        self.shape = torch.Size((len(places), *whole.shape[1:]))

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, index: Tensor | tuple[Tensor, Tensor]) -> Tensor:
        objects, *views = index if isinstance(index, tuple) else (index,)
        return self._whole[(self._places[objects], *views)]


def _parts(made: Made) -> dict[str, Any]:
    return {name: getattr(made, name)
            for name in ('images', 'seen', 'poses', 'intrinsics', 'voxels')}
