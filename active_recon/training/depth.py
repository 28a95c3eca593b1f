"""Training of a depth refiner on simulated depth cameras, beside a lifting network that stays."""

from dataclasses import dataclass

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.calibration import fit_logistic
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.models.depth_refiner import DepthRefiner
from active_recon.models.lifting import Lifting
from active_recon.models.network import Cameras
from active_recon.simulation.depth_camera import (
    draw_depth_faults,
    measured_evidence,
    with_plane,
)
from active_recon.training.loop import Draw, Run, train_steps, TrainingConfig
from active_recon.training.losses import volume_loss
from active_recon.training.posed_batches import draw_posed_batch, PosedBatch
import numpy as np
from numpy.typing import NDArray
import torch
from torch import nn, Tensor

LENGTHS = (1, 1, 1, 2, 2, 3, 3, 4, 5, 6, 8)
"""Numbers of views of a sequence, each as likely as the others."""
_ALL_SHARE, _ONE_SHARE = 0.6, 0.6  # sequences in which all views have depth; of views in others
_TABLE_SHARE, _WALL_SHARE = 0.2, 0.2  # of the sequences
_CALIBRATED, _CELLS = 12, 20_000  # objects at once; cells of each
_WALL = (0.9, 3.0)  # distance of a wall from the middle of the grid, in its sides


@dataclass(frozen=True, eq=False)
class DepthSample:
    """
    What the refiner learns from, of B objects.

    - logits: the lifting network's, (B, 64, 64, 64); evidence (B, 3, 64, 64, 64)
    - count, total: `coarse_count` and `coarse_sum` of its state
    - voxels: (B, 64, 64, 64) in {0, 1} float32
    """

    logits: Tensor
    evidence: Tensor
    count: Tensor
    total: Tensor
    voxels: Tensor


class DepthLearner(nn.Module):
    """Corrected occupancy to its loss."""

    def __init__(self, refiner: DepthRefiner, kind: str = 'bce+dice') -> None:
        super().__init__()
        self.refiner = refiner
        self._kind = kind

    def forward(self, logits: Tensor, evidence: Tensor, count: Tensor, total: Tensor,
                voxels: Tensor) -> dict[str, Tensor]:
        """Return the losses of a sample; see `DepthSample`."""
        found = self.refiner(logits, evidence, count, total)
        with torch.autocast(found.device.type, enabled=False):
            loss = volume_loss(found.float(), voxels, self._kind)
            given = volume_loss(logits.float(), voxels, self._kind)
        return {'loss': loss, 'before': given.detach()}


def train_depth(refiner: DepthRefiner, network: Lifting, views: ViewSet, config: TrainingConfig,
                run: Run, facts: dict[str, str]) -> None:
    """
    Train a refiner in place on random views of random objects; see `train_steps`.

    `views` have depth images, without noise; `facts` go into the settings of the checkpoint.
    """
    network = network.eval()

    def draw(step: int) -> Draw:
        rng = np.random.default_rng([config.seed, step])
        length = min(int(rng.choice(LENGTHS)), config.max_views)
        batch = draw_posed_batch(views, config.batch_size, length, rng, config.augment)
        sample = depth_sample(network, batch, rng, config.bfloat16)
        return Draw((sample.logits, sample.evidence, sample.count, sample.total, sample.voxels),
                    views.names(batch.objects))

    train_steps(run, DepthLearner(refiner), refiner, config,
                {'training': config.to_dict(), **facts}, views.fingerprint, draw, dict,
                weight_decay=0.01)


def calibrate_depth(refiner: DepthRefiner, network: Lifting,
                    validation: ViewSet) -> tuple[float, float]:
    """
    Set the refiner's calibration in place, and return it: the scale and the bias of its logit.

    That is Platt scaling on random cells of validation objects with 1 to 8 random views.
    """
    refiner.eval()
    refiner.calibration.copy_(torch.tensor([1.0, 0]))
    rng = np.random.default_rng(0)
    found, truth = [], []
    for length in LENGTHS:
        batch = draw_posed_batch(validation, min(_CALIBRATED, len(validation)), length, rng,
                                 augment=False)
        sample = depth_sample(network, batch, rng)
        with torch.inference_mode():
            logits = refiner(sample.logits, sample.evidence, sample.count, sample.total)
        cells = rng.integers(logits[0].numel(), size=(len(logits), _CELLS))
        found.append(np.take_along_axis(logits.flatten(1).numpy(), cells, 1).ravel())
        truth.append(np.take_along_axis(batch.voxels.flatten(1).numpy() > 0, cells, 1).ravel())
    scale, bias = fit_logistic(np.concatenate(found)[:, None], np.concatenate(truth))
    refiner.calibration.copy_(torch.tensor([scale, bias]))
    return float(scale), float(bias)


@torch.no_grad()
def depth_sample(network: Lifting, batch: PosedBatch, rng: np.random.Generator,
                 bfloat16: bool = False) -> DepthSample:
    """Return what a network makes of a batch's images, and what depth cameras with faults saw."""
    size = len(batch.voxels)
    with torch.autocast('cpu', torch.bfloat16, enabled=bfloat16):
        maps = network.maps(batch.images.flatten(0, 1))
        state = network.update_from_maps(
            maps, Cameras(batch.cameras.poses.flatten(0, 1),
                          batch.cameras.intrinsics.flatten(0, 1)), network.initial_state(size))
        logits = network.decode(state).float()
    evidence = torch.from_numpy(np.stack([_seen(batch, row, rng) for row in range(size)]))
    return DepthSample(logits, evidence, state['coarse_count'], state['coarse_sum'], batch.voxels)


def _seen(batch: PosedBatch, row: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return the evidence of an object of a batch by the depth of all or some of its views."""
    length, side = len(batch.cameras.poses), batch.voxels.shape[-1]
    have = np.full(length, True) if rng.random() < _ALL_SHARE else rng.random(length) < _ONE_SHARE
    have[rng.integers(length)] = True
    faults, place, wall = draw_depth_faults(rng), rng.random(), rng.uniform(*_WALL)
    layers = np.flatnonzero(batch.voxels[row].numpy().any((0, 1)))
    ground = (layers[0] if len(layers) else 0) / side - 0.5
    views = []
    for view in np.flatnonzero(have):
        depth, camera = depth_view(batch.depths, batch.cameras, int(view), row)
        if place < _TABLE_SHARE:
            depth = with_plane(depth, camera.ray_directions(), camera.position,
                               np.array([0.0, 0, 1]), ground)
        elif place < _TABLE_SHARE + _WALL_SHARE:
            depth = with_plane(depth, camera.ray_directions(), camera.position,
                               -camera.direction, wall)
        views.append((depth, camera))
    return measured_evidence(views, faults, rng, side)


def depth_view(depths: Tensor | None, cameras: Cameras, *place: int
               ) -> tuple[NDArray[np.float32], Camera]:
    """Return one of depth images (..., S, S), and its camera."""
    assert depths is not None, 'views were read without depth'
    depth = depths[place].numpy()
    lens, size = cameras.intrinsics[place].numpy(), depth.shape[0]
    return depth, Camera(cameras.poses[place].numpy(), Intrinsics(
        lens[0, 0], lens[1, 1], lens[0, 2], lens[1, 2], size, size))
