"""`active-recon evaluate`: what a model and its policies are worth on held-out objects."""

from collections.abc import Sequence
from dataclasses import asdict
import json
from pathlib import Path
import sys
from typing import Annotated, Any

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer


def evaluate(
    data: Annotated[Path, typer.Argument(help="Folder of objects in R2N2's layout.")],
    weights: Annotated[Path | None, typer.Option(
        help='A .safetensors file; default: the weights that ship.')] = None,
    policy: Annotated[str, typer.Option(
        help='Policies, separated by commas.')] = 'random,uniform,farthest,attention',
    views: Annotated[int, typer.Option(min=1, max=24, help='Views of an episode.')] = 5,
    starts: Annotated[int, typer.Option(
        min=1, max=24, help='First views of each object; 24 are all.')] = 4,
    seed: Annotated[int, typer.Option(help='Draws the starts and the random policy.')] = 0,
    training: Annotated[list[Path] | None, typer.Option(
        help="Training folders: adds the category's mean shape and the nearest training image, "
             'two answers that know nothing of detail (may be given several times).')] = None,
    validation: Annotated[Path | None, typer.Option(
        help="Validation folder, on which the mean shape's threshold is chosen.")] = None,
    json_file: Annotated[Path | None, typer.Option(
        '--json', help='Where the figures go, with their intervals.')] = None,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
) -> None:
    """
    Measure IoU view by view, with 95 % intervals over objects, for each policy.

    Also: the area under the IoU curve, both entropies, the rotation travelled, the IoU where the
    object's front stands wrong, and what the attention policy loses when it is shown another
    object's latent. Objects that cannot be read are listed, never silently left out.
    """
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.views import read_views
    from active_recon.evaluation.measure import (
        blindness,
        interval,
        iou_by_yaw,
        run_policy,
        summary,
    )
    from active_recon.evaluation.metrics import episodes
    from active_recon.models.weights import load_weights, weights_hash
    from active_recon.policies import load_policy
    from active_recon.policies.attention import AttentionPolicy
    import numpy as np
    import torch

    if training and validation is None:
        raise ConfigError('--training: expected --validation too, on which the threshold of the '
                          'mean shape is chosen')
    torch.set_num_threads(threads)
    bundle = load_weights(weights)
    network, threshold = bundle.reconstruction, bundle.threshold
    policies = {name: load_policy(name, weights, np.random.default_rng(seed), views)
                for name in policy.split(',')}
    folders = list_objects(data)
    with progress_bar('reading', len(folders)) as advance:
        held_out = read_views(folders, lambda: advance(1, ''))
    objects, first = episodes(held_out, starts, seed)
    result: dict[str, Any] = {
        'command': ' '.join(['active-recon', *sys.argv[1:]]),
        'model': bundle.card.get('model', '2d3d-attention'), 'weights': weights_hash(weights),
        'threshold': threshold, 'objects': len(held_out), 'episodes': len(objects),
        'unreadable': list(held_out.unreadable), 'policies': {}}
    areas = {}
    for name, chosen in policies.items():
        with progress_bar(name, len(objects)) as advance:
            run = run_policy(network, chosen, held_out, objects, first, threshold, views,
                             progress=lambda done: advance(done, ''))
        result['policies'][name] = summary(run, held_out, objects)
        areas[name] = run.auc
        typer.echo(_line(name, result['policies'][name]['iou'])
                   + f'   area {result["policies"][name]["auc"]["mean"]:.4f}')
    if 'random' in areas and len(areas) > 1:
        result['auc_above_random'] = {
            name: interval(area - areas['random'], objects.numpy())
            for name, area in areas.items() if name != 'random'}
        typer.echo("area above random's: " + ', '.join(
            f'{name} {_spread(gain, 4)}' for name, gain in result['auc_above_random'].items()))
    result['yaw'] = iou_by_yaw(network, held_out, objects, first, threshold)
    typer.echo("IoU by the front's yaw: " + ', '.join(
        f'{yaw} deg {values["mean"]:.3f}' for yaw, values in result['yaw'].items()))
    if 'attention' in policies and len(held_out) > 1:
        seeing = blindness(network, AttentionPolicy(bundle.attention), held_out, objects, first,
                           threshold, views)
        result['blindness'] = asdict(seeing)
        typer.echo(f'another object\'s latent: goals move by {seeing.goal_change_deg["mean"]:.1f} '
                   f'deg, area under IoU falls by {_spread(seeing.auc_loss, 4)}')
    if training and validation is not None:
        result['baselines'] = _baselines(training, validation, held_out, objects, first)
    if json_file:
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(result, indent=1) + '\n')
        typer.echo(f'wrote {json_file}')
    for refusal in held_out.unreadable:
        typer.echo(f'unreadable: {refusal}', err=True)


def _baselines(training: list[Path], validation: Path, held_out: Any, objects: Any,
               first: Any) -> dict[str, Any]:
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.views import read_views
    from active_recon.evaluation.baselines import (
        category_means,
        mean_shape_iou,
        nearest_image_iou,
    )
    from active_recon.evaluation.measure import interval
    from active_recon.evaluation.metrics import THRESHOLDS
    import numpy as np

    folders = [folder for root in training for folder in list_objects(root)]
    with progress_bar('reading training data', len(folders)) as advance:
        known = read_views(folders, lambda: advance(1, ''))
    means = category_means(known)
    chosen_on = read_views(list_objects(validation))
    threshold = max(THRESHOLDS, key=lambda at: mean_shape_iou(means, chosen_on, at).mean())
    every = np.arange(len(held_out))
    result = {
        'mean_shape': interval(mean_shape_iou(means, held_out, float(threshold)), every),
        'nearest_image': interval(
            nearest_image_iou(known, held_out, objects, first), objects.numpy())}
    for name, values in result.items():
        typer.echo(f'{name:>14}: {_spread(values)}')
    return result | {'mean_shape_threshold': float(threshold)}


def _spread(values: dict[str, float], digits: int = 3) -> str:
    return f'{values["mean"]:.{digits}f} [{values["low"]:.{digits}f}, {values["high"]:.{digits}f}]'


def _line(name: str, values: Sequence[dict[str, float]]) -> str:
    return f'{name:>14}: ' + '  '.join(_spread(value) for value in values)
