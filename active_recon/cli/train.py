"""`active-recon train`: the two stages, with a progress bar, checkpoints and a log."""

from collections.abc import Callable
from pathlib import Path
import sys
from typing import Annotated

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
import typer


def train(
    data: Annotated[list[Path], typer.Argument(
        help="Folders of training objects in R2N2's layout (see `active-recon dataset`).")],
    validation: Annotated[Path, typer.Option(
        help='Folder of validation objects: chooses the threshold, and nothing else does.')],
    out: Annotated[Path, typer.Option(
        help='Run folder: checkpoints, TensorBoard log, weights.')] = Path('runs/default'),
    steps: Annotated[int, typer.Option(min=1, help='Steps of the reconstruction.')] = 12000,
    policy_steps: Annotated[int, typer.Option(
        min=0, help='Steps of the view policy; 0 leaves it out.')] = 1500,
    batch_size: Annotated[int, typer.Option(min=1, help='Objects in a batch.')] = 16,
    policy_batch_size: Annotated[int, typer.Option(min=2, help='Episodes in a batch.')] = 48,
    learning_rate: Annotated[float, typer.Option(help='At its peak; then half a cosine.')] = 1e-3,
    policy_learning_rate: Annotated[float, typer.Option(help='The same, of the policy.')] = 5e-4,
    volume_loss: Annotated[str, typer.Option(help='mse (the paper), bce or dice.')] = 'mse',
    volume_weight: Annotated[float, typer.Option(help='lambda_V of section 3.2.')] = 0.4,
    silhouette_weight: Annotated[float, typer.Option(help='lambda_S of section 3.2.')] = 0.6,
    seed: Annotated[int, typer.Option(help='The same seed draws the same batches.')] = 0,
    bf16: Annotated[bool, typer.Option(help='Half precision where it is safe.')] = True,
    threads: Annotated[int, typer.Option(min=1, help='CPU threads.')] = 2,
    resume: Annotated[bool, typer.Option(
        help='Go on from the checkpoints in the run folder.')] = False,
) -> None:
    """
    Train the reconstruction network, then the view policy on it; write weights that load.

    The reconstruction learns from random views under the weighted volume and silhouette losses;
    the policy then learns by policy gradient, with the reconstruction frozen. A training that was
    cut off goes on with --resume. The weights and their card land in OUT/weights.safetensors.
    """
    from active_recon.config import LossConfig, NetworkConfig, RewardConfig
    from active_recon.datasets.layout import list_objects
    from active_recon.datasets.views import read_views, ViewSet
    from active_recon.evaluation.validation import best_threshold, policy_auc, reconstruction_iou
    from active_recon.models.attention import AttentionModel
    from active_recon.models.reconstruction import ReconstructionNetwork
    from active_recon.models.weights import Bundle, save_weights
    from active_recon.shapes import generators_hash
    from active_recon.training.policy_gradient import train_policy
    from active_recon.training.supervised import train_reconstruction, TrainingConfig
    import torch

    checkpoints = {stage: out / f'{stage}.safetensors' for stage in ('reconstruction', 'policy')}
    if not resume and any(path.exists() for path in checkpoints.values()):
        raise ConfigError(f'{out}: expected a new run folder, but it holds checkpoints; go on '
                          'with --resume, or name another folder by --out')
    loss = LossConfig(volume_weight, silhouette_weight, volume_loss)
    first = TrainingConfig(steps, batch_size, learning_rate, seed=seed, bfloat16=bf16)
    torch.set_num_threads(threads)
    torch.manual_seed(seed)

    def read(roots: list[Path], name: str) -> ViewSet:
        folders = [folder for root in roots for folder in list_objects(root)]
        with progress_bar(f'reading {name}', len(folders)) as advance:
            views = read_views(folders, lambda: advance(1, ''))
        for refusal in views.unreadable:
            typer.echo(f'left out: {refusal}', err=True)
        return views

    training, held_out = read(data, 'training data'), read([validation], 'validation data')
    network_config = NetworkConfig()
    network = ReconstructionNetwork.from_config(network_config)
    attention = AttentionModel.from_config(network_config)
    checkpoint = checkpoints['reconstruction']
    with _reporting('reconstruction', steps, out) as report:
        train_reconstruction(network, training, first, loss, checkpoint,
                             lambda model: reconstruction_iou(model, held_out), report,
                             resume and checkpoint.is_file())
    threshold = best_threshold(network, held_out)
    typer.echo(f'threshold {threshold:.2f}, chosen on validation')
    rewards = RewardConfig()
    second = TrainingConfig(max(policy_steps, 1), policy_batch_size, policy_learning_rate,
                            seed=seed, checkpoint_every=50, validate_every=250)
    if policy_steps:
        checkpoint = checkpoints['policy']
        with _reporting('policy', policy_steps, out) as report:
            train_policy(network, attention, training, threshold, second, rewards, checkpoint,
                         lambda model: policy_auc(network, model, held_out, threshold), report,
                         resume and checkpoint.is_file())
    card = {
        'command': ' '.join(['active-recon', *sys.argv[1:]]),
        'data': {str(root): sum(folder.root == root for folder in training.folders)
                 for root in data},
        'generators_sha256': generators_hash(),
        'reconstruction': first.to_dict() | loss.to_dict(),
        'policy': second.to_dict() | rewards.to_dict() if policy_steps else None,
    }
    weights = out / 'weights.safetensors'
    save_weights(weights, Bundle(network, attention, network_config, threshold, card))
    typer.echo(f'wrote {weights} and its card')


class _reporting:  # noqa: N801  (a context manager that reads as one)
    """A progress bar and a TensorBoard log over the steps of one stage."""

    def __init__(self, stage: str, steps: int, out: Path) -> None:
        from torch.utils.tensorboard import SummaryWriter
        self._writer = SummaryWriter(out / 'tensorboard')
        self._bar = progress_bar(stage, steps)
        self._stage = stage

    def __enter__(self) -> Callable[[int, dict[str, float]], None]:
        advance = self._bar.__enter__()
        done = 0
        shown: dict[str, float] = {}

        def report(step: int, measured: dict[str, float]) -> None:
            nonlocal done
            for name, value in measured.items():
                self._writer.add_scalar(f'{self._stage}/{name}', value, step)
                # Single batches are noisy: the bar shows a running mean
                smooth = name in shown and not name.startswith('validation')
                shown[name] = 0.98 * shown[name] + 0.02 * value if smooth else value
            told = '  '.join(f'{name} {value:.4f}' for name, value in shown.items())
            advance(step - done, told)
            done = step

        return report

    def __exit__(self, *error: object) -> None:
        self._writer.close()
        self._bar.__exit__(None, None, None)
