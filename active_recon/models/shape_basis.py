"""A deformable shape for each category, fitted to silhouettes: no network and no training."""

from dataclasses import dataclass
from functools import cache
import math

from active_recon.config import Config
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera, TURN, VIEW_COUNT
from active_recon.models.encoder import IMAGE_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.volumes.silhouettes import frustum, project, project_all
import numpy as np
from numpy.typing import NDArray
import torch
from torch import nn, Tensor
from torch.nn import functional

_WHITE = 0.98
_REACH = 4.0  # cells from the surface beyond which a signed distance counts no further
_SLOPE = 2.0  # of the occupancy's log-odds, per cell of signed distance
_PIXEL_WEIGHT = 1000.0  # of a view's mean squared error against the prior's half square
_STEPS, _STEP_SIZE = 30, 0.2
_OUTLINED = 64  # objects of a category that its mean silhouettes are taken from


@dataclass(frozen=True)
class ShapeBasisConfig(Config):
    """The categories whose shapes are known, and in how many modes each deforms."""

    categories: tuple[str, ...] = (
        'airplane', 'bench', 'cabinet', 'car', 'cellphone', 'chair', 'firearm', 'lamp', 'monitor',
        'sofa', 'speaker', 'table', 'watercraft')
    modes: int = 8

    def __post_init__(self) -> None:
        """Reject what holds no shapes."""
        if len(set(self.categories)) != len(self.categories) or not (
                self.categories and self.modes >= 1):
            raise ConfigError('ShapeBasisConfig: invalid categories or modes: expected different '
                              f'categories and modes of 1 or more, got {self.to_dict()}')


# It is fitted in one go, so one size is fast enough for all uses
SIZES = {'small': ShapeBasisConfig(), 'published': ShapeBasisConfig()}


class ShapeBasis(ReconstructionNetwork):
    """
    A mean shape and a deformation basis for each category, deformed until silhouettes agree.

    Kar et al. 2015, "Category-Specific Object Reconstruction from a Single Image". Theirs learns
    its shapes from silhouettes and keypoints and knows an object's category and pose from a
    detector; here shapes are principal components of true voxels' signed distances, the azimuth
    is given, and the category is the one whose mean silhouettes from there differ least. The
    silhouette is what is not background, and the background is white: the pixels with a channel
    below 0.98.

    Features are (B, 1 + modes): the category's index and the coefficients, whose prior is normal.
    The latent is the coefficients as (B, modes, 1, 1).
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 32, True
    runs_in_torch_alone = 'it searches for the likeliest shape by gradients'

    def __init__(self, categories: tuple[str, ...], modes: int) -> None:
        super().__init__()
        self.categories = categories
        grid, count = (self.resolution,) * 3, len(categories)
        # Signed distances in cells, inside above 0: a shape that was not fitted is empty
        self.means = nn.Parameter(torch.full((count, *grid), -_REACH), requires_grad=False)
        self.modes = nn.Parameter(torch.zeros(count, modes, *grid), requires_grad=False)
        # No silhouette is as far from any as this one, which is all 2
        self.outlines = nn.Parameter(
            torch.full((count, VIEW_COUNT, 32, 32), 2.0), requires_grad=False)

    @classmethod
    def from_config(cls, config: ShapeBasisConfig) -> 'ShapeBasis':
        """Build the model of a configuration, without any shapes yet."""
        return cls(config.categories, config.modes)

    def initial_state(self, batch: int) -> State:
        """
        Return the state of B objects without a view.

        Of T views, the silhouettes (B, T, 32, 32) in [0, 1] and azimuths (B, T); how far each
        category's mean silhouettes are from them, squared differences summed, (B, categories).
        """
        pixels, modes = self.outlines.shape[2:], self.modes.shape[1]
        return {'outlines': self.means.new_zeros(batch, 0, *pixels),
                'azimuths': self.means.new_zeros(batch, 0),
                'apart': self.means.new_zeros(batch, len(self.categories)),
                'features': self.means.new_zeros(batch, 1 + modes),
                'latent': self.means.new_zeros(batch, modes, 1, 1)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' silhouettes, (B, 32, 32)."""
        return outlines_of(images)

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Add silhouettes, seen from 30 degrees up, and fit the shape to all of them."""
        azimuths = cameras.azimuths
        nearest = (azimuths / TURN * VIEW_COUNT).round().long() % VIEW_COUNT
        here = encoded[:, None]
        apart = (self.outlines[:, nearest].transpose(0, 1) - here).square().sum((2, 3))
        known = {'outlines': torch.cat([state['outlines'], here], dim=1),
                 'azimuths': torch.cat([state['azimuths'], azimuths[:, None]], dim=1),
                 'apart': state['apart'] + apart}
        category = known['apart'].argmin(dim=1)
        coefficients = self.fitted(category, known['outlines'], known['azimuths'])
        features = torch.cat([category[:, None].to(coefficients), coefficients], dim=1)
        return known | {'features': features, 'latent': coefficients[:, :, None, None]}

    def fitted(self, category: Tensor, outlines: Tensor, azimuths: Tensor) -> Tensor:
        """Return the likeliest coefficients (B, modes) of objects of categories (B,)."""
        # Callers that only infer switch gradients off for good; fitting needs them, and tensors
        # that were made with them.
        with torch.inference_mode(False), torch.enable_grad():
            mean, modes = self.means[category.clone()], self.modes[category.clone()]
            frusta, truth = frusta_at(azimuths.clone().flatten()), outlines.clone().flatten(0, 1)
            coefficients = mean.new_zeros(modes.shape[:2]).requires_grad_()
            optimizer = torch.optim.Adam([coefficients], _STEP_SIZE, betas=(0.9, 0.9))
            views = outlines.shape[1]
            for _ in range(_STEPS):
                occupancy = _log_odds(mean, modes, coefficients).sigmoid()
                found = project(occupancy.repeat_interleave(views, dim=0), frusta)
                misfit = (found - truth).square().mean((1, 2)).sum()
                energy = _PIXEL_WEIGHT * misfit + coefficients.square().sum() / 2
                coefficients.grad, = torch.autograd.grad(energy, coefficients)
                optimizer.step()
            return coefficients.detach()

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, (B, 32, 32, 32), of categories and coefficients."""
        features = state['features']
        category = features[:, 0].long()
        return _log_odds(self.means[category], self.modes[category], features[:, 1:])


def _log_odds(mean: Tensor, modes: Tensor, coefficients: Tensor) -> Tensor:
    deformed = torch.einsum('bm,bmxyz->bxyz', coefficients, modes)
    return _SLOPE * (mean + deformed)


@torch.no_grad()
def fit_shapes(model: ShapeBasis, voxels: Tensor, categories: NDArray[np.str_]) -> None:
    """
    Fit the shapes to voxels (N, 32, 32, 32), bool, of categories (N,), in place.

    A category that has no objects is never chosen; one of few deforms in fewer modes. Objects of
    categories that the model does not know are left out; raises DataError where none is known.
    """
    if not set(categories.tolist()) & set(model.categories):
        raise DataError('shape-basis: no objects of its categories: expected '
                        f'{", ".join(model.categories)}, got '
                        f'{", ".join(sorted(set(categories.tolist())))}')
    frusta = frustum([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    for index, category in enumerate(model.categories):
        members = voxels[torch.from_numpy(categories == category)]
        if not len(members):
            continue
        distances = torch.from_numpy(np.stack([signed_distance(one.numpy()) for one in members]))
        mean = distances.mean(dim=0)
        apart = (distances - mean).flatten(1)
        # Principal components by way of the objects' products: far fewer than there are voxels
        _, vectors = torch.linalg.eigh(apart @ apart.T)
        main = vectors.flip(1)[:, :model.modes.shape[1]] / len(members) ** 0.5
        modes = (main.T @ apart).reshape(-1, *mean.shape)  # as long as the shapes' deviations
        model.means[index] = mean
        model.modes[index] = 0
        model.modes[index, :len(modes)] = modes
        some = members[::math.ceil(len(members) / _OUTLINED)].float()
        model.outlines[index] = project_all(some, frusta).mean(dim=0)


def signed_distance(voxels: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return every cell's distance to the surface in cells, above 0 inside, at most 4."""
    from scipy.ndimage import distance_transform_edt

    inside, outside = (np.pad(part, 1, constant_values=empty)  # beyond the grid there is nothing
                       for part, empty in ((voxels, False), (~voxels, True)))
    distance = distance_transform_edt(inside) - distance_transform_edt(outside)
    core = distance[1:-1, 1:-1, 1:-1]
    surface = core - np.sign(core) / 2  # lies half a cell from either cell's centre
    return np.asarray(np.clip(surface, -_REACH, _REACH), np.float32)


def outlines_of(images: Tensor) -> Tensor:
    """Return silhouettes (B, 32, 32) in [0, 1] of images (B, 3, 64, 64) on white."""
    outside = (images >= _WHITE).all(dim=1, keepdim=True)
    return functional.avg_pool2d((~outside).float(), 2)[:, 0]


def frusta_at(azimuths: Tensor) -> Tensor:
    """Return the frusta of canonical cameras at azimuths (N,), (N, D, S, S, 3); see `frustum`."""
    z, y, x = _front().to(azimuths.device).unbind(dim=-1)
    sine, cosine = (part[:, None, None, None] for part in (azimuths.sin(), azimuths.cos()))
    return torch.stack(
        [z.expand(len(azimuths), *z.shape), x * sine + y * cosine, x * cosine - y * sine], dim=-1)


@cache
def _front() -> Tensor:
    return frustum([orbit_camera(0.0)])[0]
