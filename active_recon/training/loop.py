"""The loop that every training shares: steps, validation, checkpoints, several processes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
import os
from pathlib import Path
from typing import Any, Protocol

from active_recon.config import Config
from active_recon.datasets.views import ViewSet
from active_recon.errors import ActiveReconError, ConfigError
from active_recon.freed_memory import give_back_freed_memory
from active_recon.interrupts import held_interrupts
from active_recon.runtimes.precision import has_bf16
from active_recon.training.ahead import drawn_ahead
from active_recon.training.allocation import keep_freed_memory
from active_recon.training.checkpoints import Checkpoint, resume_checkpoint, save_checkpoint
from lightning_fabric import Fabric
import numpy as np
import torch
from torch import nn, Tensor

Measured = dict[str, float]
_MOST_DRAW_THREADS = 8


@dataclass(frozen=True)
class TrainingConfig(Config):
    """
    How a stage is trained, apart from its data and the network's sizes.

    During the first `curriculum_fraction` of the steps a reconstruction learns from sequences of
    at most two views. The learning rate rises linearly over `warmup_steps`.
    """

    steps: int
    batch_size: int = 16
    learning_rate: float = 1e-3
    max_views: int = 5
    seed: int = 0
    bfloat16: bool = True
    augment: bool = True
    curriculum_fraction: float = 0.5
    warmup_steps: int = 200
    checkpoint_every: int = 200
    validate_every: int = 500

    def __post_init__(self) -> None:
        """Reject what trains nothing."""
        if min(self.steps, self.batch_size, self.max_views, self.warmup_steps,
               self.checkpoint_every, self.validate_every) < 1 or not (
                   0 < self.learning_rate < math.inf):
            raise ConfigError('TrainingConfig: number out of range: expected finite numbers above '
                              f'0, got {self.to_dict()}')
        if not 0 <= self.curriculum_fraction <= 1:
            raise ConfigError('TrainingConfig: invalid curriculum_fraction: expected 0 to 1, got '
                              f'{self.curriculum_fraction}')


class TrainingDivergedError(ActiveReconError):
    """A loss, or its gradient, is not finite."""


class TrainingStoppedError(KeyboardInterrupt):
    """Ctrl-C or SIGTERM; raised after the step is done and its checkpoint is saved."""


@dataclass(frozen=True)
class Draw:
    """What a step learns from: the arguments of the learner, and the names of the objects."""

    arguments: tuple[Any, ...]
    names: tuple[str, ...]


class TrainingObjects(Protocol):
    """
    The objects that a training draws from: those of a `ViewSet`, or objects made meanwhile.

    `fingerprint` is a SHA-256: a training is resumed with the same objects only.
    """

    @property
    def fingerprint(self) -> str:
        """SHA-256 of what tells the objects of all steps."""

    def at(self, step: int) -> ViewSet:
        """Return the objects that a step draws from, which depend on its number alone."""


@dataclass(frozen=True)
class Run:
    """
    Where a training runs, where its checkpoint is, and what is called as it goes.

    With `resume` it continues from the checkpoint, if there is one. `report` is called after every
    step with the step and what was measured, `show` after every validation with the step.
    `draw_threads` draw batches ahead, see `drawn_ahead`; None: as many as `threads_to_draw` tells.
    `begun_with` is the SHA-256 of the weights that the training begins with, '' for fresh ones.
    """

    fabric: Fabric
    checkpoint_path: Path
    report: Callable[[int, Measured], None]
    resume: bool = False
    until: int | None = None  # stops early, as an interrupted training does
    show: Callable[[int], None] = lambda step: None
    draw_threads: int | None = None
    begun_with: str = ''


def trains_in_bfloat16() -> bool:
    """Return whether what trains here, the GPU where there is one, computes with bfloat16."""
    if torch.cuda.is_available():
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    return has_bf16()


def make_fabric(bfloat16: bool, devices: int = 1, nodes: int = 1) -> Fabric:
    """
    Return what runs a training on `devices` processes of each of `nodes` machines.

    A GPU is used where there is one. Every process draws its own part of a batch, and from now on
    keeps the memory that it frees, see `keep_freed_memory`.
    """
    keep_freed_memory()
    return Fabric(accelerator='auto', devices=devices, num_nodes=nodes,
                  strategy='ddp' if devices * nodes > 1 else 'auto',
                  precision='bf16-mixed' if bfloat16 else '32-true')


def threads_to_draw(fabric: Fabric) -> int:
    """Return how many threads draw batches: none on a CPU, where the steps need all cores."""
    if fabric.device.type == 'cpu':
        return 0
    return min(_MOST_DRAW_THREADS, max(1, (os.cpu_count() or 1) // fabric.world_size - 1))


def lr_factor(step: int, steps: int, warmup_steps: int = 200) -> float:
    """Return the factor of the learning rate at a step: half a cosine, times a linear warm-up."""
    warmup = min(1.0, (step + 1) / warmup_steps)
    return warmup * 0.5 * (1 + math.cos(math.pi * step / steps))


def share_of_batch(config: TrainingConfig, fabric: Fabric) -> int:
    """Return how many objects of a batch this process draws; raises ConfigError on a remainder."""
    if config.batch_size % fabric.world_size:
        raise ConfigError('batch_size: not divisible: expected a multiple of the '
                          f'{fabric.world_size} processes, got {config.batch_size}')
    return config.batch_size // fabric.world_size


def train_steps(
    run: Run, learner: nn.Module, trained: nn.Module, config: TrainingConfig,
    settings: dict[str, Any], fingerprint: str, draw: Callable[[int], Draw],
    validate: Callable[[], Measured], weight_decay: float,
) -> None:
    """
    Train in place: `learner`, called with the arguments of `draw`, returns losses, also `loss`.

    `trained` is the part of the learner that checkpoints hold, `fingerprint` that of the objects
    it learns from. Every step's draw, and what torch draws in it, such as dropout, depend on the
    seed and the step alone, so a training that was interrupted and resumed gives the same result
    as one that was not. `run.report` is called after
    every step with the losses, and with what `validate` measured where it did. Raises
    TrainingDivergedError naming the batch where a loss or its gradient is not finite, ConfigError
    on a checkpoint of other settings or data, and TrainingStoppedError where it was interrupted.
    """
    fabric = run.fabric
    parameters = [part for part in trained.parameters() if part.requires_grad]
    raw = torch.optim.AdamW(parameters, config.learning_rate, betas=(0.9, 0.99),
                            weight_decay=weight_decay)
    wrapped, optimizer = fabric.setup(learner, raw)
    settings = {**settings, 'data': fingerprint, 'begun_with': run.begun_with}
    begun = Checkpoint(0, settings, [])
    if run.resume and run.checkpoint_path.is_file():
        begun = resume_checkpoint(run.checkpoint_path, trained, raw, settings)
    schedule = torch.optim.lr_scheduler.LambdaLR(raw, lambda done: lr_factor(
        begun.step + done, config.steps, config.warmup_steps))
    learner.train()
    with held_interrupts() as raise_if_asked:
        steps = range(begun.step, min(config.steps, run.until or config.steps))
        threads = threads_to_draw(fabric) if run.draw_threads is None else run.draw_threads
        for step, drawn in drawn_ahead(draw, steps, threads):
            torch.manual_seed(_torch_seed(config.seed, step, fabric.global_rank))
            losses = wrapped(*fabric.to_device(drawn.arguments))
            _refuse_divergence(fabric, step, 'loss', losses['loss'], drawn.names)
            optimizer.zero_grad(set_to_none=True)
            fabric.backward(losses['loss'])
            norm = fabric.clip_gradients(wrapped, optimizer, max_norm=1.0,
                                         error_if_nonfinite=False)
            _refuse_divergence(fabric, step, "gradient's norm", torch.as_tensor(norm), drawn.names)
            optimizer.step()
            schedule.step()
            measured = {name: value.item() for name, value in losses.items()}
            last = step + 1 == config.steps
            is_checkpoint = last or (step + 1) % config.checkpoint_every == 0
            stopping = not last and _is_asked_to_stop(fabric, raise_if_asked)
            if is_checkpoint:
                # Steps of all sizes leave gaps between what they keep: gigabytes in an hour,
                # which validation needs
                give_back_freed_memory()
            if last or (step + 1) % config.validate_every == 0:
                if fabric.is_global_zero:
                    learner.eval()
                    measured |= validate()
                    run.show(step + 1)
                    learner.train()
                begun.log.append({'step': step + 1, **measured})
            if fabric.is_global_zero:
                run.report(step + 1, measured)
                if is_checkpoint or stopping:
                    save_checkpoint(run.checkpoint_path, trained, raw,
                                    Checkpoint(step + 1, settings, begun.log))
            if stopping:
                raise TrainingStoppedError(
                    f'stopped at step {step + 1} of {config.steps}; continue with --resume')
    fabric.barrier()
    learner.eval()


def _torch_seed(*numbers: int) -> int:
    return int(np.random.SeedSequence(numbers).generate_state(1)[0])


def _is_asked_to_stop(fabric: Fabric, raise_if_asked: Callable[[], None]) -> bool:
    """Return whether any process was asked to stop, the same on all of them."""
    try:
        raise_if_asked()
        asked = False
    except KeyboardInterrupt:
        asked = True
    if fabric.world_size > 1:
        count = fabric.all_reduce(torch.tensor(float(asked)), reduce_op='sum')
        asked = bool(torch.as_tensor(count) > 0)
    return asked


def _refuse_divergence(fabric: Fabric, step: int, what: str, value: Tensor,
                       names: Sequence[str]) -> None:
    """Raise TrainingDivergedError on every process, each naming its own batch (B,)."""
    finite = torch.isfinite(value.detach())
    if fabric.world_size > 1:
        finite = torch.as_tensor(fabric.all_reduce(finite.float(), reduce_op='sum')
                                 == fabric.world_size)
    if not finite:
        raise TrainingDivergedError(f'step {step}: the {what} is {value.item()} on the batch '
                                    f'{", ".join(names)}; try a lower learning rate')
