"""Blocks of a trial's episodes, measured by workers that make the same trial anew."""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
import os
from pathlib import Path
from typing import Any

from active_recon.cluster import Crew
from active_recon.cluster.telling import told
from active_recon.errors import WorkError
from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.trial import Contender, Trial, write_arrays
from active_recon.reporting import Reporting
import torch

Block = tuple[str, int]
"""A contender's key, and the number of a block of its episodes."""
Prepare = Callable[[], tuple[Trial, Sequence[Contender]]]


def run_blocks(prepare: Prepare, trial: Trial, every: Sequence[Contender], crew: Crew,
               reads: Sequence[Path], reporting: Reporting) -> None:
    """
    Measure the episodes that are not in the trial's cache on the workers, and put them there.

    `prepare` is pickled; it gives a worker the same trial and contenders, from the paths in
    `reads`. Raises WorkError where a worker has other data or weights than the driver, or an
    episode fails.
    """
    paths = {(each.key, block): path for each in every for block in range(trial.blocks)
             if (path := trial.cached(each, block)) and not path.is_file()}
    items = list(paths)
    if not items:
        return
    measure = partial(_measure_block, prepare, tuple(trial.identity.items()),
                      torch.get_num_threads())
    with reporting('measuring', len(items)) as advance:
        results = crew.map(measure, items, reads=reads)
        for result in told(results, crew, advance):
            if result.refusal:
                raise WorkError(f'{" ".join(map(str, items[result.index]))}: {result.refusal}')
            write_arrays(paths[items[result.index]], **vars(result.value))


def _measure_block(prepare: Prepare, identity: Sequence[tuple[str, Any]], threads: int,
                   block: Block) -> Episodes:
    """Measure one block in a worker, which keeps data and network for the next."""
    torch.set_num_threads(threads)
    trial, every = _kept(prepare)
    differing = [name for name, value in identity if trial.identity[name] != value]
    if differing:
        raise WorkError(f'{os.uname().nodename}: other {" and ".join(differing)} than the driver '
                        'has: expected the same files at the same paths')
    [contender] = [each for each in every if each.key == block[0]]
    return trial.run_block(contender, block[1])


@lru_cache(maxsize=1)
def _kept(prepare: Prepare) -> tuple[Trial, Sequence[Contender]]:
    return prepare()
