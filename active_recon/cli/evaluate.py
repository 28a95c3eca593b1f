"""`active-recon evaluate`: the IoU of a model under view policies, on held-out objects."""

from contextlib import ExitStack
from dataclasses import dataclass
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.bf16_option import Bf16, in_bf16
from active_recon.cli.cluster_option import (
    Cluster,
    ClusterWorkers,
    reachable,
    require_cluster,
    workers_of,
)
from active_recon.cli.command_line import command_line
from active_recon.cli.evaluate_studies import (
    print_baselines,
    print_latent_swap,
    print_yaw,
    require_swappable,
)
from active_recon.cli.intervals import difference, line, spread
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import Split
from active_recon.cli.runtime_option import MeasuredIn
from active_recon.errors import ConfigError
from active_recon.models.weights_files import DEFAULT_MODEL
from active_recon.policies import POLICIES
from active_recon.whole_files import whole_file, writable
import typer

if TYPE_CHECKING:
    from active_recon.cluster import Crew
    from active_recon.evaluation.policy_study import Runs
    from active_recon.evaluation.trial import Contender, Trial
    from active_recon.models.weights import Bundle


def evaluate(
    data: Annotated[Path, typer.Argument(
        help="Folder of test objects in R2N2's layout, or of PASCAL3D+, whose photographs are "
             'reconstructed from a single view.')],
    model: Annotated[str | None, typer.Option(
        help='Name of a model that ships, or a .safetensors file; default: '
             f'{DEFAULT_MODEL}.')] = None,
    policy: Annotated[str | None, typer.Option(
        help=f'Policies, separated by commas: {", ".join(POLICIES)}, oracle (uses the true '
             'shape; takes ninety times as long). Default: those that use the cameras only, and '
             'attention if the model has it.')] = None,
    against: Annotated[str | None, typer.Option(
        help='Second model, measured on the same objects and starts: prints the difference '
             'to it, with its interval.')] = None,
    paired: Annotated[bool, typer.Option(
        '--paired', help='Print the difference between the two policies given by --policy, with '
                         'its interval.')] = False,
    views: Annotated[int, typer.Option(
        min=1, max=24, help='Number of views of an episode.')] = 5,
    starts: Annotated[int, typer.Option(
        min=1, max=24, help='Number of first views measured for each object, out of 24.')] = 4,
    seeds: Annotated[int, typer.Option(
        min=1, help='Number of runs of the policy random.')] = 5,
    seed: Annotated[int, typer.Option(
        min=0, help='Seed of the starts and of the policy random.')] = 0,
    split_file: Split = None,
    training: Annotated[list[Path] | None, typer.Option(
        help='Training folder: also measure two baselines, the mean shape of the category and '
             'the nearest training image (may be given several times).')] = None,
    validation: Annotated[Path | None, typer.Option(
        help='Validation folder, on which the threshold of the mean shape is chosen.')] = None,
    json_file: Annotated[Path | None, typer.Option(
        '--json', help='JSON file for the results, with their intervals.')] = None,
    rows: Annotated[Path | None, typer.Option(
        help='CSV file for the results, one row for each object, start and view.')] = None,
    yaw_study: Annotated[bool, typer.Option(
        '--yaw-study', help="Also measure IoU with wrong yaws of the object's front.")] = False,
    latent_study: Annotated[bool, typer.Option(
        '--latent-study', help='Latent-swap ablation: also measure the loss of the attention '
                               "policy when it gets another object's latent.")] = False,
    cache: Annotated[Path | None, typer.Option(
        help='Folder that caches episodes, so that an interrupted run can continue.')] = None,
    bf16: Bf16 = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads of each process.')] = 2,
    runtime: MeasuredIn = 'torch',
    cluster: Cluster = None,
    workers: ClusterWorkers = None,
) -> None:
    """
    Measure the IoU of a model after each view, for each policy, with 95 % intervals.

    The intervals are over objects, starts and seeds. Also measured: the area under the IoU curve,
    both entropies, the rotation travelled and, with the oracle, the fraction of the gap between
    random and oracle that a policy closes. --against and --paired compare models or policies
    episode by episode. Objects that cannot be read are listed.

    Example: active-recon evaluate data/test --model runs/new/weights.safetensors
    --against runs/old/weights.safetensors --policy farthest --rows both.csv
    """
    from active_recon.cli.evaluation_plan import EvaluationPlan, run_on_crew
    from active_recon.datasets.layout import needed_objects
    from active_recon.evaluation.paired import paired as between
    from active_recon.evaluation.paired import require_same_episodes, write_rows
    from active_recon.evaluation.policy_study import compare, run_all
    from active_recon.models.weights import load_weights
    from active_recon.models.weights_files import find_weights, weights_hash
    import torch

    require_cluster(cluster, workers)
    if training and validation is None:
        raise ConfigError('--training: no validation objects: expected --validation too, on which '
                          'the threshold of the mean shape is chosen, got none')
    if validation is not None and not training:
        raise ConfigError('--validation: no effect: expected --training too, whose mean shape has '
                          'its threshold chosen there, got none')
    named = list(dict.fromkeys(map(str.strip, policy.split(',')))) if policy else []
    if paired and len(named) != 2:
        raise ConfigError('--paired: wrong number of policies: expected two in --policy, got '
                          f'{len(named)}')
    if against:
        one, two = (load_weights(find_weights(each)).reconstruction.resolution
                    for each in (model, against))
        if one != two:
            raise ConfigError(f'--against: another resolution: expected weights of {one} cells a '
                              f'side, as those of --model, got {two}; `active-recon study` '
                              'measures networks of several at the same cells')
    for path in filter(None, (json_file, rows)):
        writable(path)  # tells before hours of measuring
    for each in filter(None, (*(training or ()), validation)):
        needed_objects(each)
    torch.set_num_threads(threads)
    plan = EvaluationPlan(reachable(data, cluster), tuple(named), views, starts, seeds, seed,
                          split_file, in_bf16(bf16), threads, runtime)

    def measure(weights: Path, crew: 'Crew | None', bundle: 'Bundle', trial: 'Trial',
                every: 'list[Contender]') -> _Measured:
        if crew is not None:
            run_on_crew(plan, weights, trial, every, crew)
        return _Measured(weights, bundle, trial, run_all(trial, every, progress_bar))

    with ExitStack() as stack:
        crew = stack.enter_context(workers_of(cluster, workers)) if cluster else None
        folder = cache if cache or not cluster else Path(
            stack.enter_context(TemporaryDirectory()))
        files = [find_weights(each) for each in (model, *([against] if against else []))]
        prepared = [plan.prepared(weights, folder, tell=True) for weights in files]
        bundle, trial, _ = prepared[0]
        if latent_study:
            require_swappable(trial, bundle)
        for _, compared, _ in prepared[1:]:
            require_same_episodes(trial, compared)
        # All that can be refused was, before hours of measuring
        own, *others = (measure(weights, crew, *each)
                        for weights, each in zip(files, prepared, strict=True))
    result: dict[str, Any] = {
        'command': command_line(),
        'model': own.bundle.model, 'weights': weights_hash(own.weights),
        'threshold': trial.threshold, 'objects': len(trial.views), 'episodes': len(trial.objects),
        'unreadable': list(trial.views.unreadable), **compare(trial, own.runs)}
    _print_policies(result)
    for other in others:
        result['against'] = {
            'model': other.bundle.model, 'weights': weights_hash(other.weights),
            'above': {name: between(runs, other.runs[name], trial.objects)
                      for name, runs in own.runs.items() if name in other.runs}}
        for name, figures in result['against']['above'].items():
            typer.echo(f'{name}, difference to {against}: {difference(figures)}')
    if paired:
        first, second = named
        result['paired'] = between(own.runs[first], own.runs[second], trial.objects)
        typer.echo(f'{first} minus {second}: {difference(result["paired"])}')
    if rows:
        models = {str(each.weights): (each.trial, each.runs) for each in (own, *others)}
        write_rows(rows, models)
        typer.echo(f'wrote {rows}')
    if yaw_study:
        result['yaw'] = print_yaw(trial)
    if latent_study:
        result['latent_swap'] = print_latent_swap(trial, own.bundle)
    if training and validation is not None:
        result['baselines'] = print_baselines(training, validation, trial)
    if json_file:
        with whole_file(json_file) as unfinished:
            unfinished.write_text(json.dumps(result, indent=1) + '\n')
        typer.echo(f'wrote {json_file}')


@dataclass(frozen=True, eq=False)
class _Measured:
    """A weights file, and the episodes of each policy under its network."""

    weights: Path
    bundle: 'Bundle'
    trial: 'Trial'
    runs: 'Runs'


def _print_policies(result: dict[str, Any]) -> None:
    for name, figures in result['policies'].items():
        above = figures['auc_above'].get('random')
        share = figures.get('gap_closed')
        typer.echo(line(name, figures['iou']) + f'   area {figures["auc"]["mean"]:.4f}'
                   + (f', minus random {spread(above, 4)}' if above else '')
                   + (f', fraction of the gap {spread(share, 2)}' if share else ''))
    if 'headroom_sentence' in result:
        typer.echo(result['headroom_sentence'])
