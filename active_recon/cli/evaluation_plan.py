"""What `active-recon evaluate` measures, made anew in each worker of a cluster."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import read_objects
from active_recon.cluster import Crew
from active_recon.datasets.splits import SORTED
from active_recon.evaluation.blocks import run_blocks
from active_recon.evaluation.contenders import contender_names, contenders
from active_recon.evaluation.exported_network import network_in
from active_recon.evaluation.trial import Contender, Trial
from active_recon.models.scorer_weights import policy_module
from active_recon.models.weights import Bundle, load_weights
import typer


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
                           attentions, count, self.seeds, self.seed, bundle.model,
                           weights)
        network = network_in(self.runtime, weights, bundle, self.bf16, self.threads)
        return bundle, Trial(network, bundle.threshold, held_out, starts, count,
                             self.seed, self.bf16, cache), every


def run_on_crew(plan: EvaluationPlan, weights: Path, trial: Trial, every: Sequence[Contender],
                crew: Crew) -> None:
    """Measure what is not in the trial's cache on the workers; raises as `run_blocks`."""
    reads = [plan.data, weights]
    if plan.split_file not in (None, SORTED):  # workers begin in folders of their own
        reads.append(Path(plan.split_file).absolute())
        plan = replace(plan, split_file=str(reads[-1]))
    run_blocks(partial(_trial, plan, weights.absolute()), trial, every, crew, reads, progress_bar)


def _trial(plan: EvaluationPlan, weights: Path) -> tuple[Trial, list[Contender]]:
    _, trial, every = plan.prepared(weights)
    return trial, every
