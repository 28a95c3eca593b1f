"""Two renderings of the same views: what repeats is worth choosing, what does not is luck."""

from dataclasses import replace
import math

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.posed.robustness import poses_off
import numpy as np
import torch

POSE_ERROR = math.radians(0.5)
EXPOSURE, COLOR, SLOPE, NOISE = 0.15, 0.05, 0.15, 0.02


def another_rendering(views: ViewSet, seed: int) -> ViewSet:
    """
    Return the same views of a set under another light, with image noise and poses a little off.

    Each view has its own exposure (within 15 %), white balance (5 %), light that falls off across
    the image (15 % at its border) and Gaussian noise of 2 % on the object; the network is told a
    pose that is off by half a degree about the object's centre. The background stays white and
    the outline sharp: what a camera varies beyond that is not in it.
    """
    rng, side = np.random.default_rng([seed, 3]), views.image_size
    shape = views.images.shape[:2]
    across = (np.arange(side) + 0.5) / side * 2 - 1
    images = np.empty_like(views.images.numpy())
    for place in np.ndindex(*shape):
        own = views.images[place].numpy().astype(np.float32)
        slopes = rng.uniform(-SLOPE, SLOPE, 2)
        light = (1 + slopes[0] * across + slopes[1] * across[:, None])[..., None]
        gains = rng.uniform(1 - EXPOSURE, 1 + EXPOSURE) * rng.uniform(1 - COLOR, 1 + COLOR, 3)
        grain = rng.standard_normal((side, side, 3), np.float32) * (NOISE * own[..., 3:])
        images[place] = own.round()
        images[place][..., :3] = (own[..., :3] * light * gains + grain).clip(
            0, own[..., 3:]).round()
    return replace(views, images=torch.from_numpy(images),
                   poses=poses_off(views, POSE_ERROR, seed))
