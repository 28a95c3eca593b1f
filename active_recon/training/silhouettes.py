"""IoU of silhouettes that are found before backgrounds of every kind."""

from collections.abc import Callable, Sequence

from active_recon.datasets.views import ViewSet
from active_recon.training.posed_batches import draw_posed_batch
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

KINDS = ('white', 'plain', 'noise', 'clutter', 'pieces', 'tiles', 'black')
_BLOCK = 16  # objects at once
_LEAST = 4  # pixels of the object in an image that counts


@torch.inference_mode()
def silhouette_ious(find: Callable[[Tensor], Tensor], views: ViewSet, kind: str,
                    count: int = 256) -> NDArray[np.float64]:
    """
    Return the IoU of the silhouettes that are found in random images of random objects, (N,).

    `find` returns logits (B, 1, S, S) of images (B, 4, S, S) with a background of a kind, some of
    them with a table, blur, noise and parts that are cut off; only pixels that were seen count.
    Of the `count` images, those with nearly nothing of the object are left out.
    """
    rng, found = np.random.default_rng(0), []
    for size in (min(_BLOCK, count - done) for done in range(0, count, _BLOCK)):
        batch = draw_posed_batch(views, size, 1, rng, True, {kind: 1.0})
        images = batch.images[0]
        seen = images[:, 3] > 0.5
        inside = (find(images)[:, 0] > 0) & seen
        truth = (batch.alpha[0] > 0.5) & seen
        both, either = (mask.sum(dim=(1, 2)) for mask in (inside & truth, inside | truth))
        shown = truth.sum(dim=(1, 2)) >= _LEAST
        found.append((both / either)[shown].double().numpy())
    return np.concatenate(found)


def silhouette_figures(find: Callable[[Tensor], Tensor], views: ViewSet,
                       kinds: Sequence[str] = KINDS, count: int = 256,
                       advance: Callable[[str], None] = lambda kind: None) -> dict[str, float]:
    """
    Return the mean IoU of silhouettes before backgrounds of each kind; see above.

    `advance` is called with each kind once it is measured.
    """
    found = {}
    for kind in kinds:
        found[kind] = round(float(silhouette_ious(find, views, kind, count).mean()), 4)
        advance(kind)
    return found
