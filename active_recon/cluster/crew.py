"""The seam: one function for many items, here or on a cluster."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
import os
import re
from typing import Any, Protocol

from active_recon.cluster.local import LocalCrew
from active_recon.cluster.results import Result
from active_recon.cluster.stores import Place
from active_recon.errors import ConfigError

LOCAL = 'local'
_ADDRESS = re.compile(r'auto|local|ray://\S+:\d+|[\w.-]+:\d+')


class Crew(Protocol):
    """
    Workers that take one item after another.

    - workers: how many there are now
    - dashboard: the address of a page that shows them, '' where there is none
    """

    @property
    def workers(self) -> int: ...

    @property
    def dashboard(self) -> str: ...

    def map(self, function: Callable[[Any], Any], items: Iterable[Any],
            shared: Place | None = None, reads: Sequence[Place] = ()) -> Iterator[Result]:
        """
        Yield the result of the function for each item, in the order of their completion.

        Function and items are pickled; the function goes to each worker once. Items are drawn as
        workers have room, so that memory does not grow with their number. What the function raises
        refuses the item, and a worker's death begins it again, up to three times. Raises WorkError
        where no item can succeed any more: a disk without room, or a machine of the cluster that
        does not see `shared`, the folder that is written to, or a place in `reads`. All paths that
        function and items hold must be absolute, since workers begin in folders of their own.
        """
        ...


@contextmanager
def crew_of(cluster: str | None = None, workers: int | None = None) -> Iterator[Crew]:
    """
    Yield the workers of a cluster; None: processes of this machine.

    - cluster: 'auto' (the Ray that RAY_ADDRESS names, else the one that runs on this machine),
      'ray://host:port', 'host:port', or 'local' (a Ray that is started on this machine and ends
      with the block)
    - workers: how many at once; None: one for each core, of this machine or of the cluster

    Raises ConfigError where Ray is missing or the cluster cannot be reached.
    """
    if cluster is None:
        yield LocalCrew(workers or os.cpu_count() or 1)
        return
    if not _ADDRESS.fullmatch(cluster):
        raise ConfigError("--cluster: invalid address: expected 'auto', 'local', "
                          f"'ray://HOST:PORT' or 'HOST:PORT', got {cluster!r}")
    from active_recon.cluster.ray_crew import RayCrew

    crew = RayCrew(cluster, workers)
    try:
        yield crew
    finally:
        crew.close()


def map_items(function: Callable[[Any], Any], items: Iterable[Any], cluster: str | None = None,
              workers: int | None = None, shared: Place | None = None,
              reads: Sequence[Place] = ()) -> Iterator[Result]:
    """Yield the results of a function for many items, as `Crew.map` of `crew_of` does."""
    with crew_of(cluster, workers) as crew:
        yield from crew.map(function, items, shared, reads)
