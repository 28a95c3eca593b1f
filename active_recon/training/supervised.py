"""The first stage: the reconstruction network under section 3.2's losses, on random views."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from pathlib import Path

from active_recon.cameras import AZIMUTHS, orbit_camera
from active_recon.config import Config, LossConfig
from active_recon.datasets.views import ViewSet
from active_recon.errors import ActiveReconError, ConfigError
from active_recon.models.reconstruction import Hidden, ReconstructionNetwork
from active_recon.silhouettes import frustum
from active_recon.training.batches import Batch, draw_batch
from active_recon.training.checkpoints import Checkpoint, resume_checkpoint, save_checkpoint
from active_recon.training.losses import reconstruction_loss
import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class TrainingConfig(Config):
    """How a stage is trained; what it is trained on and the sizes stand elsewhere."""

    steps: int
    batch_size: int = 16
    learning_rate: float = 1e-3
    max_views: int = 5
    seed: int = 0
    bfloat16: bool = True
    checkpoint_every: int = 200
    validate_every: int = 500

    def __post_init__(self) -> None:
        """Refuse what trains nothing."""
        if min(self.steps, self.batch_size, self.max_views, self.checkpoint_every,
               self.validate_every) < 1 or not self.learning_rate > 0:
            raise ConfigError(f'TrainingConfig: expected numbers above 0, got {self.to_dict()}')


class TrainingDivergedError(ActiveReconError):
    """A loss that is not finite."""


def learning_rate_share(step: int, steps: int, warm_up: int = 200) -> float:
    """Return the share of the learning rate at a step: a linear start, then half a cosine."""
    rise = min(1.0, (step + 1) / warm_up)
    return rise * 0.5 * (1 + math.cos(math.pi * step / steps))


def train_reconstruction(
    network: ReconstructionNetwork, views: ViewSet, config: TrainingConfig, loss: LossConfig,
    checkpoint_path: Path, validate: Callable[[ReconstructionNetwork], dict[str, float]],
    report: Callable[[int, dict[str, float]], None], resume: bool = False,
    until: int | None = None,
) -> None:
    """
    Train in place, writing checkpoints; every step's draw depends on the seed and step alone.

    So a training that was cut off and resumed walks the same path as one that was not. `report`
    is called after every step with the losses, and with what `validate` measured where it did.
    `until` stops early, as a cut would. Raises TrainingDivergedError naming the batch where a
    loss is not finite.
    """
    optimizer = torch.optim.AdamW(network.parameters(), config.learning_rate, betas=(0.9, 0.99),
                                  weight_decay=0.01)
    settings = {'training': config.to_dict(), 'loss': loss.to_dict()}
    begun = Checkpoint(0, settings, [])
    if resume:
        begun = resume_checkpoint(checkpoint_path, network, optimizer, settings)
    log = begun.log
    frusta = frustum([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    network.train()
    for step in range(begun.step, min(config.steps, until or config.steps)):
        rng = np.random.default_rng([config.seed, step])
        length = int(rng.integers(1, config.max_views + 1))
        batch = draw_batch(views, config.batch_size, length, rng)
        for group in optimizer.param_groups:
            group['lr'] = config.learning_rate * learning_rate_share(step, config.steps)
        with torch.autocast('cpu', torch.bfloat16, enabled=config.bfloat16):
            sequence = unroll(network, batch)
        seen_from = frusta[torch.from_numpy(rng.integers(len(frusta), size=config.batch_size))]
        total, parts = reconstruction_loss(
            sequence, batch.voxels, seen_from, int(rng.integers(length)), loss)
        refuse_divergence(step, total, views, batch.objects)
        optimizer.zero_grad(set_to_none=True)
        total.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        measured = {'loss': total.item(), **parts}
        last = step + 1 == config.steps
        if last or (step + 1) % config.validate_every == 0:
            network.eval()
            measured |= validate(network)
            network.train()
            log.append({'step': step + 1, **measured})
        report(step + 1, measured)
        if last or (step + 1) % config.checkpoint_every == 0:
            save_checkpoint(checkpoint_path, network, optimizer,
                            Checkpoint(step + 1, settings, log))
    network.eval()


def refuse_divergence(step: int, loss: Tensor, views: ViewSet, objects: Tensor) -> None:
    """Raise TrainingDivergedError, naming the batch's objects (B,), if a loss is not finite."""
    if not torch.isfinite(loss):
        names = [views.folders[i].name for i in objects.tolist()]
        raise TrainingDivergedError(f'step {step}: the loss is {loss.item()} on the batch '
                                    f'{", ".join(names)}; try a lower learning rate')


def unroll(network: ReconstructionNetwork, batch: Batch) -> list[Tensor]:
    """Return the logits after each view of a batch, T times (B, 32, 32, 32)."""
    hidden: Hidden | None = None
    sequence = []
    for images in batch.images:
        seen, hidden = network(images, hidden)
        sequence.append(seen.logits)
    return sequence
