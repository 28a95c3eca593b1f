"""The optional studies of `active-recon evaluate`: yaw of the front, latent swap, baselines."""

from dataclasses import asdict
from pathlib import Path
from typing import Any, TYPE_CHECKING

from active_recon.cli.intervals import spread
from active_recon.cli.progress import progress_bar
from active_recon.cli.reading import read_objects
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.evaluation.trial import Trial
    from active_recon.models.weights import Bundle
    from torch import Tensor


def print_yaw(trial: 'Trial') -> dict[str, dict[str, float]]:
    """Measure and print the IoU by the error of the front's yaw."""
    from active_recon.evaluation.ablations import iou_by_yaw

    objects, first = _few_starts(trial)
    with progress_bar("the front's yaw", len(objects)) as advance:
        found = iou_by_yaw(trial.network, trial.views, objects, first, trial.threshold,
                           lambda done: advance(done, ''))
    typer.echo("IoU by the front's yaw: " + ', '.join(
        f'{angle} deg {values["mean"]:.3f}' for angle, values in found.items()))
    return found


def require_swappable(trial: 'Trial', bundle: 'Bundle') -> None:
    """Raise ConfigError without an attention policy, or with fewer than two objects or views."""
    if bundle.attention is None or len(trial.views) < 2 or trial.count < 2:
        raise ConfigError('--latent-study: cannot swap latents: expected a model with an '
                          'attention policy, two objects or more and two views or more')


def print_latent_swap(trial: 'Trial', bundle: 'Bundle') -> dict[str, Any]:
    """Measure and print what the attention policy loses with another object's latent."""
    from active_recon.evaluation.ablations import latent_swap_ablation
    from active_recon.policies import learned_policy
    from active_recon.runtimes.torch import TorchPolicyRuntime

    attention = bundle.attention
    assert attention is not None
    objects, first = _few_starts(trial)
    with progress_bar("other objects' latents", 2 * len(objects)) as advance:
        swap = latent_swap_ablation(
            trial.network, learned_policy(bundle.model, TorchPolicyRuntime(attention)),
            trial.views, objects, first, trial.threshold, trial.count,
            lambda done: advance(done, ''))
    typer.echo(f"another object's latent: goals move by {swap.goal_change_deg['mean']:.1f} "
               f'deg, area under IoU falls by {spread(swap.auc_loss, 4)}')
    return asdict(swap)


def _few_starts(trial: 'Trial') -> tuple['Tensor', 'Tensor']:
    """Return objects and first views; these studies do not compare policies: few are enough."""
    from active_recon.evaluation.metrics import episodes

    starts = len(trial.objects) // len(trial.views)
    return episodes(trial.views, min(starts, 4), trial.identity['seed'])


def print_baselines(training: list[Path], validation: Path, trial: 'Trial') -> dict[str, Any]:
    """Measure and print the two baselines that use no detail of an object."""
    from active_recon.evaluation.baselines import Baselines
    from active_recon.evaluation.measure import interval
    import torch

    held_out = trial.views
    asked = trial.network.spec
    found = Baselines.of(read_objects(training, 'training data', asked),
                         read_objects([validation], 'validation data', asked))
    result = {
        'mean_shape': interval(found.mean_shape(held_out), torch.arange(len(held_out))),
        'nearest_image': interval(
            found.nearest_image(held_out, trial.objects, trial.starts), trial.objects)}
    for name, values in result.items():
        typer.echo(f'{name:>14}: {spread(values)}')
    return result | {'mean_shape_threshold': found.threshold}
