"""Training of a segmenter: silhouettes of objects before backgrounds of every kind."""

from active_recon.datasets.views import ViewSet
from active_recon.models.segmenter import Segmenter
from active_recon.training.loop import Draw, Run, share_of_batch, train_steps, TrainingConfig
from active_recon.training.posed_batches import draw_posed_batch
import numpy as np
import torch
from torch import nn, Tensor
from torch.nn import functional

SHARES = {'white': 0.04, 'plain': 0.08, 'gradient': 0.08, 'noise': 0.16, 'clutter': 0.2,
          'pieces': 0.2, 'tiles': 0.14, 'black': 0.06, 'dark': 0.04}
"""The fraction of the images that have each kind of background: mostly those that are hard."""
TABLE_SHARE = 0.45
"""The fraction of the images in which the object stands on a table: most photos are such."""
VIEWS = 2
"""Images of each object in a step, before one background."""


class SegmenterLearner(nn.Module):
    """Images to the loss of their silhouettes: binary cross-entropy and soft IoU."""

    def __init__(self, segmenter: Segmenter) -> None:
        super().__init__()
        self.segmenter = segmenter

    def forward(self, images: Tensor, alpha: Tensor) -> dict[str, Tensor]:
        """Return the losses of images (N, 4, S, S) of silhouettes (N, S, S) in [0, 1]."""
        logits = self.segmenter(images)[:, 0]
        with torch.autocast(images.device.type, enabled=False):
            seen = images[:, 3]
            cross = functional.binary_cross_entropy_with_logits(logits.float(), alpha,
                                                                reduction='none')
            entropy = (cross * seen).sum() / seen.sum()
            share = logits.float().sigmoid() * seen
            both = (share * alpha).sum(dim=(1, 2))
            either = (share + alpha * seen - share * alpha).sum(dim=(1, 2))
            apart = 1 - ((both + 1) / (either + 1)).mean()
        return {'loss': entropy + 0.5 * apart, 'soft IoU': (1 - apart).detach()}


def train_segmenter(segmenter: Segmenter, views: ViewSet, config: TrainingConfig,
                    run: Run) -> None:
    """Train a segmenter in place on random views of random objects; see `train_steps`."""
    size = share_of_batch(config, run.fabric)

    def draw(step: int) -> Draw:
        rng = np.random.default_rng([config.seed, step, run.fabric.global_rank])
        batch = draw_posed_batch(views, size, VIEWS, rng, config.augment, SHARES,
                                 TABLE_SHARE)
        return Draw((batch.images.flatten(0, 1), batch.alpha.flatten(0, 1)),
                    views.names(batch.objects))

    train_steps(run, SegmenterLearner(segmenter), segmenter, config,
                {'training': config.to_dict(), 'backgrounds': SHARES, 'tables': TABLE_SHARE},
                views.fingerprint, draw, dict, weight_decay=0.01)
