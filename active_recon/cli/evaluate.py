"""`active-recon evaluate`: what a model and its policies are worth on held-out objects."""

from collections.abc import Sequence
from dataclasses import asdict
import json
from pathlib import Path
import sys
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import read_objects, Split
from active_recon.errors import ConfigError
from active_recon.policies import POLICIES
import typer

if TYPE_CHECKING:
    from active_recon.evaluation.trial import Trial


def evaluate(
    data: Annotated[Path, typer.Argument(
        help="Folder of objects in R2N2's layout, or PASCAL3D+'s, whose photographs are measured "
             'at a single view.')],
    model: Annotated[str | None, typer.Option(
        help='A model that ships, by its name, or a .safetensors file; default: '
             '2d3d-attention.')] = None,
    policy: Annotated[str | None, typer.Option(
        help=f'Policies, separated by commas, out of {", ".join(POLICIES)}, oracle (sees the '
             'truth; ninety times the work). Default: all but the oracle, attention only where '
             'the model has it.')] = None,
    views: Annotated[int, typer.Option(min=1, max=24, help='Views of an episode.')] = 5,
    starts: Annotated[int, typer.Option(
        min=1, max=24, help='First views of each object; 24 are all.')] = 4,
    seeds: Annotated[int, typer.Option(min=1, help='How often random is drawn.')] = 5,
    seed: Annotated[int, typer.Option(help='Draws the starts and the random policy.')] = 0,
    split_file: Split = None,
    training: Annotated[list[Path] | None, typer.Option(
        help="Training folders: adds the category's mean shape and the nearest training image, "
             'two answers that know nothing of detail (may be given several times).')] = None,
    validation: Annotated[Path | None, typer.Option(
        help="Validation folder, on which the mean shape's threshold is chosen.")] = None,
    json_file: Annotated[Path | None, typer.Option(
        '--json', help='Where the figures go, with their intervals.')] = None,
    cache: Annotated[Path | None, typer.Option(
        help='Folder in which episodes are kept: a run that was cut off goes on.')] = None,
    bf16: Annotated[bool, typer.Option(
        help='Half precision where it is safe: half the time, and means that differ by less than '
             '0.0001.')] = True,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
) -> None:
    """
    Measure IoU view by view for each policy, with 95 % intervals over objects, starts and seeds.

    Also: the area under the IoU curve, both entropies, the rotation travelled, the IoU where the
    object's front stands wrong, what the attention policy loses when it is shown another object's
    latent, and with an oracle the share of the gap between random and it that a policy closes.
    Objects that cannot be read are listed, never silently left out.
    """
    from active_recon.evaluation.measure import blindness, iou_by_yaw
    from active_recon.evaluation.metrics import episodes
    from active_recon.evaluation.policy_study import (
        compare,
        contender_names,
        contenders,
        run_all,
    )
    from active_recon.evaluation.trial import Trial
    from active_recon.models.weights import load_weights
    from active_recon.policies import learned_policy
    from active_recon.runtimes.torch import TorchPolicyRuntime
    from active_recon.weights_files import find_weights, weights_hash
    import torch

    if training and validation is None:
        raise ConfigError('--training: expected --validation too, on which the threshold of the '
                          'mean shape is chosen')
    torch.set_num_threads(threads)
    weights = find_weights(model)
    bundle = load_weights(weights)
    network, threshold = bundle.reconstruction, bundle.threshold
    attentions = [bundle.attention] if bundle.attention else []
    names = policy.split(',') if policy else contender_names(
        bool(attentions), oracle=False)
    held_out = read_objects([data], 'objects', network.spec, split_file, 'test')
    shown = held_out.azimuths.shape[1]
    if max(views, starts) > shown:
        typer.echo(f'objects of {shown} views: {min(views, shown)} views from '
                   f'{min(starts, shown)} starts are measured', err=True)
    views, starts = min(views, shown), min(starts, shown)
    every = contenders(names, attentions, views, seeds, seed, bundle.model)
    trial = Trial(network, threshold, held_out, starts, views, seed, bf16, cache)
    result: dict[str, Any] = {
        'command': ' '.join(['active-recon', *sys.argv[1:]]),
        'model': bundle.model, 'weights': weights_hash(weights), 'threshold': threshold,
        'objects': len(held_out), 'episodes': len(trial.objects),
        'unreadable': list(held_out.unreadable),
        **compare(trial, run_all(trial, every, progress_bar))}
    _tell_policies(result)
    # Few starts are enough for what is no comparison of policies
    objects, first = episodes(held_out, min(starts, 4), seed)
    with progress_bar("the front's yaw", len(objects)) as advance:
        result['yaw'] = iou_by_yaw(network, held_out, objects, first, threshold,
                                   lambda done: advance(done, ''))
    typer.echo("IoU by the front's yaw: " + ', '.join(
        f'{yaw} deg {values["mean"]:.3f}' for yaw, values in result['yaw'].items()))
    if bundle.attention and 'attention' in names and len(held_out) > 1 and views > 1:
        with progress_bar("other objects' latents", 2 * len(objects)) as advance:
            seeing = blindness(
                network, learned_policy(bundle.model, TorchPolicyRuntime(bundle.attention)),
                held_out, objects, first, threshold, views, lambda done: advance(done, ''))
        result['blindness'] = asdict(seeing)
        typer.echo(f'another object\'s latent: goals move by {seeing.goal_change_deg["mean"]:.1f} '
                   f'deg, area under IoU falls by {_spread(seeing.auc_loss, 4)}')
    if training and validation is not None:
        result['baselines'] = _baselines(training, validation, trial)
    if json_file:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(result, indent=1) + '\n')
        typer.echo(f'wrote {json_file}')


def _tell_policies(result: dict[str, Any]) -> None:
    for name, figures in result['policies'].items():
        above = figures['auc_above'].get('random')
        share = figures.get('gap_closed')
        typer.echo(_line(name, figures['iou']) + f'   area {figures["auc"]["mean"]:.4f}'
                   + (f', above random {_spread(above, 4)}' if above else '')
                   + (f', share of the gap {_spread(share, 2)}' if share else ''))
    if 'headroom_sentence' in result:
        typer.echo(result['headroom_sentence'])


def _baselines(training: list[Path], validation: Path, trial: 'Trial') -> dict[str, Any]:
    from active_recon.evaluation.baselines import (
        category_means,
        mean_shape_iou,
        nearest_image_iou,
    )
    from active_recon.evaluation.measure import interval
    from active_recon.evaluation.metrics import THRESHOLDS
    import torch

    held_out = trial.views
    asked = trial.network.spec
    known = read_objects(training, 'training data', asked)
    means = category_means(known)
    chosen_on = read_objects([validation], 'validation data', asked)
    threshold = max(THRESHOLDS, key=lambda at: mean_shape_iou(means, chosen_on, at).mean())
    result = {
        'mean_shape': interval(mean_shape_iou(means, held_out, float(threshold)),
                               torch.arange(len(held_out))),
        'nearest_image': interval(
            nearest_image_iou(known, held_out, trial.objects, trial.starts), trial.objects)}
    for name, values in result.items():
        typer.echo(f'{name:>14}: {_spread(values)}')
    return result | {'mean_shape_threshold': float(threshold)}


def _spread(values: dict[str, float], digits: int = 3) -> str:
    return f'{values["mean"]:.{digits}f} [{values["low"]:.{digits}f}, {values["high"]:.{digits}f}]'


def _line(name: str, values: Sequence[dict[str, float]]) -> str:
    return f'{name:>14}: ' + '  '.join(_spread(value) for value in values)
