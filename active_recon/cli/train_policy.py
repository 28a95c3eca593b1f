"""`active-recon train-policy`: a view policy for a frozen network, learned from measured gains."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.bf16_option import Bf16, in_bf16
from active_recon.cli.cluster_option import Cluster, reachable, workers_of
from active_recon.cli.command_line import command_line
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import print_left_out, warn_of_shared_objects
from active_recon.cli.runtime_option import MeasuredIn
from active_recon.errors import ConfigError
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.whole_files import writable
import typer

if TYPE_CHECKING:
    from active_recon.cluster import Crew
    from active_recon.evaluation.posed.entrants import Entrant
    from active_recon.models.view_scorer import ViewScorer
    from active_recon.training.gain_files import Collecting
    from active_recon.training.looked import LookedStates


def train_policy(
    data: Annotated[list[Path], typer.Argument(
        help="Folders of training objects in R2N2's layout, seen from any cameras (see "
             '`active-recon dataset build --fine`).')],
    validation: Annotated[list[Path], typer.Option(
        help='Folder of other objects, on which the expected gains are calibrated; may be given '
             'several times.')],
    model: Annotated[str, typer.Option(
        help='The network, which stays as it is: a model that ships, or a weights file.'
        )] = DEFAULT_MODEL,
    out: Annotated[Path, typer.Option(
        help='Folder of the measured gains, and of the weights at the end.'
        )] = Path('runs/policy'),
    rounds: Annotated[int, typer.Option(
        min=1, help='How often states are collected: first of mixed policies, then each time of '
                    'the policy that was learned before.')] = 2,
    objects: Annotated[int, typer.Option(
        min=1, help='At most so many objects of a folder and round, drawn.')] = 200,
    candidates: Annotated[int, typer.Option(
        min=3, help='Views of an object that are candidates, drawn.')] = 8,
    starts: Annotated[int, typer.Option(min=1, help='Episodes of an object.')] = 2,
    views: Annotated[int, typer.Option(
        min=2, help='Views of the longest episode; all but the last give a state.')] = 5,
    epochs: Annotated[int, typer.Option(min=1, help='Passes over all states.')] = 40,
    batch_size: Annotated[int, typer.Option(min=1, help='States of a batch.')] = 32,
    learning_rate: Annotated[float, typer.Option(help='Peak learning rate.')] = 1.5e-3,
    seed: Annotated[int, typer.Option(min=0, help='Seed of the weights and batches.')] = 0,
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads of each process.')] = 2,
    workers: Annotated[int, typer.Option(
        min=1, help='Processes that measure gains; with --cluster so many of its cores.')] = 1,
    init_from: Annotated[Path | None, typer.Option(
        help='A scorer file of this or an earlier network (WEIGHTS-scorer.safetensors): it '
             'chooses the views of the first round, and its weights are those that the training '
             'begins with.')] = None,
    cluster: Cluster = None,
    runtime: MeasuredIn = 'torch',
) -> None:
    """
    Train a view policy for a frozen network: which view adds most IoU.

    In states of objects that are known, every candidate is tried, and a small network learns the
    order of what they add, and how much that is. Gains are kept in OUT/gains-N, so that an
    interrupted run continues where it stopped; an object takes some seconds of a core. Writes
    OUT/<weights>-scorer.safetensors and its card: copy both beside the network's weights, and
    `policy: attention` finds them. Where a network was trained further, --init-from lets its
    policy follow it: one round and half of the epochs do.

    For example:

      active-recon train-policy turn/train things/train --validation turn/val --out runs/policy
    """
    from active_recon.datasets.layout import needed_objects
    from active_recon.evaluation.posed.entrants import load_entrants
    from active_recon.models.scorer_weights import load_scorer_of_any_network, save_scorer
    from active_recon.models.view_scorer import ScorerConfig
    from active_recon.models.weights import state_hash
    from active_recon.models.weights_files import scorer_path
    from active_recon.training.gain_files import Collecting
    from active_recon.training.looked import joined
    from active_recon.training.scorer import (
        calibrate,
        gap_shares,
        scorer_to_train,
        ScorerTraining,
        train_scorer,
    )
    import torch

    torch.set_num_threads(threads)
    half = in_bf16(bf16)
    entrant, *others = load_entrants(model, runtime, half, threads)
    if others or entrant.network.needs_front:
        raise ConfigError('--model: no such network: expected one that takes any cameras, such as '
                          f'lifting, got {model!r}')
    collecting = Collecting(objects, candidates, starts, views, half)
    counts: dict[str, int] = {}
    config = ScorerConfig()
    training = ScorerTraining(epochs, batch_size, learning_rate, seed=seed)
    learned: list[LookedStates] = []
    held_out: list[LookedStates] = []
    begun = None if init_from is None else load_scorer_of_any_network(init_from)
    scorer_to_train(config, begun)  # refuses other sizes before anything is measured
    trained, tested = ([each for folder in folders for each in needed_objects(folder)]
                       for folders in (data, validation))
    warn_of_shared_objects(trained, tested, 'the expected gains are biased')
    assert entrant.path is not None  # of a file, as all that are loaded
    path = writable(out / scorer_path(entrant.path).name)
    scorer = begun
    told: list[dict[str, Any]] = []
    # What the views that gains are measured after were chosen by
    chosen_by: dict[str, Any] = {'begun_with': state_hash(begun) if begun else ''}
    for number in range(1, rounds + 1):
        with workers_of(cluster, workers) as crew:
            source = _Source(entrant, collecting, config.patches, reachable(out, cluster), crew,
                             counts, chosen_by)
            learned += source.states(data, number, scorer)
            held_out += source.states(validation, number, scorer)
        train, test = joined(learned), joined(held_out)
        with progress_bar(f'training, round {number}', epochs) as advance:
            scorer = train_scorer(train, config, training, partial(advance, 1), begun)
        chosen_by.update(training=training.to_dict(), data=sorted(map(str, data)))
        calibrate(scorer, test)
        shares = gap_shares(scorer, test)
        told.append({'train_states': sum(map(len, train)),
                     'validation_states': sum(map(len, test)),
                     'validation_share_of_the_one_step_gap': shares})
        typer.echo(f'round {number}: {shares["all"]:.2f} of the one-step gap on validation')
    assert scorer is not None
    save_scorer(path, scorer, config, entrant.weights, {
        'command': command_line(), 'network': entrant.name,
        'training': training.to_dict(), 'collecting': collecting.to_dict(),
        'data': {str(folder): count for folder, count in counts.items()},
        'rounds': told, 'calibration': scorer.calibration.tolist()})
    typer.echo(f'wrote {path}')


class _Source:
    """Where states come from; `counts` gets the number of objects of each folder and round."""

    def __init__(self, entrant: 'Entrant', collecting: 'Collecting', patches: int, out: Path,
                 crew: 'Crew', counts: dict[str, int], chosen_by: dict[str, Any]) -> None:
        self._entrant, self._collecting, self._patches = entrant, collecting, patches
        self._out, self._crew, self._counts = out, crew, counts
        self._chosen_by = chosen_by

    def states(self, folders: list[Path], number: int,
               scorer: 'ViewScorer | None') -> list['LookedStates']:
        """Return the states of folders in a round, measuring those that are not yet."""
        from active_recon.policies.scoring import ScoringPolicy
        from active_recon.runtimes.torch import TorchPolicyRuntime
        from active_recon.training.gain_files import collect_gains, drawn_objects
        from active_recon.training.looked import looked_states
        from active_recon.training.view_gains import ViewGains

        policy = None if scorer is None else ScoringPolicy(TorchPolicyRuntime(scorer))
        found = []
        for folder in folders:
            kept = self._out / f'gains-{number}' / '-'.join(folder.parts).strip('/-')
            drawn = drawn_objects(folder.absolute(), self._collecting.objects, number)
            title = f'gains of {folder}, round {number}'
            with progress_bar(title, len(drawn)) as advance:
                files, left_out = collect_gains(drawn, self._entrant, self._collecting, kept,
                                                policy, advance, self._crew, self._chosen_by)
            print_left_out(title, len(files), (), left_out)
            self._counts[f'{folder}, round {number}'] = len(files)
            found += [looked_states(ViewGains.load(file), self._patches) for file in files]
        return found
