"""The loop that every training shares: steps, validation, checkpoints, several processes."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path
from typing import Any

from active_recon.config import Config
from active_recon.datasets.views import ViewSet
from active_recon.errors import ActiveReconError, ConfigError
from active_recon.interrupts import held_interrupts
from active_recon.training.checkpoints import Checkpoint, resume_checkpoint, save_checkpoint
from lightning_fabric import Fabric
import torch
from torch import nn, Tensor

Measured = dict[str, float]


@dataclass(frozen=True)
class TrainingConfig(Config):
    """
    How a stage is trained; what it is trained on and the sizes stand elsewhere.

    `short_share` is the share of the steps, from the first on, in which a reconstruction learns
    from sequences of two views at most.
    """

    steps: int
    batch_size: int = 16
    learning_rate: float = 1e-3
    max_views: int = 5
    seed: int = 0
    bfloat16: bool = True
    varied: bool = True
    short_share: float = 0.5
    warm_up: int = 200
    checkpoint_every: int = 200
    validate_every: int = 500

    def __post_init__(self) -> None:
        """Refuse what trains nothing."""
        if min(self.steps, self.batch_size, self.max_views, self.warm_up, self.checkpoint_every,
               self.validate_every) < 1 or not self.learning_rate > 0:
            raise ConfigError(f'TrainingConfig: expected numbers above 0, got {self.to_dict()}')
        if not 0 <= self.short_share <= 1:
            raise ConfigError('TrainingConfig: expected a short_share from 0 to 1, got '
                              f'{self.short_share}')


class TrainingDivergedError(ActiveReconError):
    """A loss that is not finite."""


class TrainingStoppedError(KeyboardInterrupt):
    """Ctrl-C or SIGTERM, answered once the step was done and its checkpoint saved."""


@dataclass(frozen=True)
class Draw:
    """What a step learns from: the arguments of its module, and the objects they came from."""

    arguments: tuple[Any, ...]
    objects: Tensor


@dataclass(frozen=True)
class Run:
    """
    Where a training stands on disk, whom it tells, and on how many processes it runs.

    `show` is called where it was validated, for who wants to look at what was learned.
    """

    fabric: Fabric
    checkpoint_path: Path
    report: Callable[[int, Measured], None]
    resume: bool = False
    until: int | None = None  # stops early, as a cut would
    show: Callable[[int], None] = lambda step: None


def make_fabric(bfloat16: bool, devices: int = 1, nodes: int = 1) -> Fabric:
    """
    Return what runs a training on `devices` processes of each of `nodes` machines.

    A graphics card is used where there is one. Every process draws its own share of a batch.
    """
    return Fabric(accelerator='auto', devices=devices, num_nodes=nodes,
                  strategy='ddp' if devices * nodes > 1 else 'auto',
                  precision='bf16-mixed' if bfloat16 else '32-true')


def learning_rate_share(step: int, steps: int, warm_up: int = 200) -> float:
    """Return the share of the learning rate at a step: a linear start, then half a cosine."""
    rise = min(1.0, (step + 1) / warm_up)
    return rise * 0.5 * (1 + math.cos(math.pi * step / steps))


def share_of_batch(config: TrainingConfig, fabric: Fabric) -> int:
    """Return how many objects of a batch this process draws; ConfigError if it divides badly."""
    if config.batch_size % fabric.world_size:
        raise ConfigError(f'batch_size: expected a multiple of the {fabric.world_size} processes,'
                          f' got {config.batch_size}')
    return config.batch_size // fabric.world_size


def train_steps(
    run: Run, learner: nn.Module, trained: nn.Module, config: TrainingConfig,
    settings: dict[str, Any], views: ViewSet, draw: Callable[[int], Draw],
    validate: Callable[[], Measured], weight_decay: float,
) -> None:
    """
    Train in place: `learner`, called with what `draw` gave, returns losses, of them `loss`.

    `trained` is the part of the learner that checkpoints hold. Every step's draw depends on the
    seed and the step alone, so a training that was cut off and resumed walks the same path as
    one that was not. `run.report` is called after every step with the losses, and with what
    `validate` measured where it did. Raises TrainingDivergedError naming the batch where a loss
    is not finite, ConfigError on a checkpoint of other settings, and TrainingStoppedError where
    it was asked to stop.
    """
    fabric = run.fabric
    parameters = [part for part in trained.parameters() if part.requires_grad]
    raw = torch.optim.AdamW(parameters, config.learning_rate, betas=(0.9, 0.99),
                            weight_decay=weight_decay)
    wrapped, optimizer = fabric.setup(learner, raw)
    begun = Checkpoint(0, settings, [])
    if run.resume:
        begun = resume_checkpoint(run.checkpoint_path, trained, raw, settings)
    learner.train()
    with held_interrupts() as raise_if_asked:
        for step in range(begun.step, min(config.steps, run.until or config.steps)):
            for group in raw.param_groups:
                group['lr'] = config.learning_rate * learning_rate_share(
                    step, config.steps, config.warm_up)
            drawn = draw(step)
            losses = wrapped(*fabric.to_device(drawn.arguments))
            _refuse_divergence(fabric, step, losses['loss'], views, drawn.objects)
            optimizer.zero_grad(set_to_none=True)
            fabric.backward(losses['loss'])
            fabric.clip_gradients(wrapped, optimizer, max_norm=1.0)
            optimizer.step()
            measured = {name: value.item() for name, value in losses.items()}
            last = step + 1 == config.steps
            stopping = not last and _is_asked_to_stop(fabric, raise_if_asked)
            if last or (step + 1) % config.validate_every == 0:
                if fabric.is_global_zero:
                    learner.eval()
                    measured |= validate()
                    run.show(step + 1)
                    learner.train()
                begun.log.append({'step': step + 1, **measured})
            if fabric.is_global_zero:
                run.report(step + 1, measured)
                if last or stopping or (step + 1) % config.checkpoint_every == 0:
                    save_checkpoint(run.checkpoint_path, trained, raw,
                                    Checkpoint(step + 1, settings, begun.log))
            if stopping:
                raise TrainingStoppedError(
                    f'stopped at step {step + 1} of {config.steps}; continue with --resume')
    fabric.barrier()
    learner.eval()


def _is_asked_to_stop(fabric: Fabric, raise_if_asked: Callable[[], None]) -> bool:
    """Return whether any process was asked, the same on all of them."""
    try:
        raise_if_asked()
        asked = False
    except KeyboardInterrupt:
        asked = True
    if fabric.world_size > 1:
        told = fabric.all_reduce(torch.tensor(float(asked)), reduce_op='sum')
        asked = bool(torch.as_tensor(told) > 0)
    return asked


def _refuse_divergence(fabric: Fabric, step: int, loss: Tensor, views: ViewSet,
                       objects: Tensor) -> None:
    """Raise TrainingDivergedError on every process alike, each naming its own batch (B,)."""
    finite = torch.isfinite(loss.detach())
    if fabric.world_size > 1:
        finite = torch.as_tensor(fabric.all_reduce(finite.float(), reduce_op='sum')
                                 == fabric.world_size)
    if not finite:
        names = [views.folders[i].name for i in objects.tolist()]
        raise TrainingDivergedError(f'step {step}: the loss is {loss.item()} on the batch '
                                    f'{", ".join(names)}; try a lower learning rate')
