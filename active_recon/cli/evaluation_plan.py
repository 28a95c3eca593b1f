"""What `active-recon evaluate` measures, made anew in each worker of a cluster."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
import os
from pathlib import Path
from typing import Any

from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import read_objects
from active_recon.cluster import Crew, Result
from active_recon.cluster.telling import told
from active_recon.errors import WorkError
from active_recon.evaluation.contenders import contender_names, contenders
from active_recon.evaluation.exported_network import network_in
from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.trial import Contender, Trial, write_arrays
from active_recon.models.scorer_weights import policy_module
from active_recon.models.weights import Bundle, load_weights
import torch
import typer

Block = tuple[str, int]
"""A contender's key, and the number of a block of its episodes."""


@dataclass(frozen=True)
class EvaluationPlan:
    """The options of the command that its episodes depend on."""

    data: Path
    policies: Sequence[str]
    views: int
    starts: int
    seeds: int
    seed: int
    split_file: str | None
    bf16: bool
    threads: int
    runtime: str = 'torch'

    def prepared(self, weights: Path, cache: Path | None = None, tell: bool = False
                 ) -> tuple[Bundle, Trial, list[Contender]]:
        """Return the network of a weights file, its trial and the policies that are compared."""
        bundle = load_weights(weights)
        learned = policy_module(weights, bundle)
        attentions = [learned] if learned else []
        held_out = read_objects([self.data], 'objects', bundle.reconstruction.spec,
                                self.split_file, 'test')
        shown = held_out.azimuths.shape[1]
        count, starts = min(self.views, shown), min(self.starts, shown)
        if tell and max(self.views, self.starts) > shown:
            typer.echo(f'views per object: {shown}; measured views: {count}; starts: {starts}',
                       err=True)
        every = contenders(self.policies or contender_names(bool(attentions), oracle=False),
                           attentions, count, self.seeds, self.seed, bundle.model)
        network = network_in(self.runtime, weights, bundle, self.bf16, self.threads)
        return bundle, Trial(network, bundle.threshold, held_out, starts, count,
                             self.seed, self.bf16, cache), every


def run_blocks(plan: EvaluationPlan, weights: Path, trial: Trial, every: Sequence[Contender],
               crew: Crew) -> None:
    """
    Measure the episodes that are not in the trial's cache on the workers, and put them there.

    Raises WorkError where a worker has other data or weights than the driver, or an episode fails.
    """
    paths = {(each.key, block): path for each in every for block in range(trial.blocks)
             if (path := trial.cached(each, block)) and not path.is_file()}
    items = list(paths)
    measure = partial(_measure_block, plan, weights.absolute(), tuple(trial.identity.items()))
    with progress_bar('measuring', len(items)) as advance:
        results = crew.map(measure, items, reads=[plan.data, weights])
        for result in told(results, crew, advance, _was_refused):
            if result.refusal:
                raise WorkError(f'{" ".join(map(str, items[result.index]))}: {result.refusal}')
            write_arrays(paths[items[result.index]], **vars(result.value))


def _was_refused(result: Result) -> bool:
    return bool(result.refusal)


def _measure_block(plan: EvaluationPlan, weights: Path, identity: Sequence[tuple[str, Any]],
                   block: Block) -> Episodes:
    """Measure one block in a worker, which keeps data and network for the next."""
    torch.set_num_threads(plan.threads)
    trial, every = _kept(plan, weights)
    differing = [name for name, value in identity if trial.identity[name] != value]
    if differing:
        raise WorkError(f'{os.uname().nodename}: other {" and ".join(differing)} than the driver '
                        f'has: expected the same files at {plan.data} and {weights}')
    return trial.run_block(every[block[0]], block[1])


@lru_cache(maxsize=1)
def _kept(plan: EvaluationPlan, weights: Path) -> tuple[Trial, Mapping[str, Contender]]:
    _, trial, every = plan.prepared(weights)
    return trial, {each.key: each for each in every}
