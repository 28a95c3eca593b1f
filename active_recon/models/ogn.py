"""The Octree Generating Network, which divides only the cells that are mixed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.encoder import group_norm
from active_recon.models.mean_code import ImageEncoder, MeanCodeNetwork
from active_recon.models.network import State
from active_recon.models.octree import (
    all_cells,
    at,
    children_of,
    COARSEST,
    EMPTY,
    expand,
    FILLED,
    MIXED,
    states_of,
)
from active_recon.models.sparse_convolution import neighbours_of, SparseConv3d
import torch
from torch import nn, Tensor
from torch.nn import functional

_FINEST_CONVOLVED = 32
_FLOAT_BYTES = 4


@dataclass(frozen=True)
class OgnConfig(Config):
    """
    Sizes of the Octree Generating Network.

    `level_channels` are those of a cell's features at 8, 16, ... cells a side, up to `resolution`.
    """

    image_channels: tuple[int, ...]
    code_channels: tuple[int, ...]
    level_channels: tuple[int, ...]
    resolution: int = 32

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        parts = (self.image_channels, self.code_channels, self.level_channels)
        if any(not part or min(part) < 1 for part in parts) or len(self.image_channels) > 6:
            raise ConfigError('OgnConfig: invalid channels: expected 1 or more in every part, six '
                              f'at most of the image, got {self.to_dict()}')
        finest = COARSEST * 2 ** (len(self.level_channels) - 1)
        if finest != self.resolution or self.resolution <= COARSEST:
            raise ConfigError('OgnConfig: invalid levels: expected channels for every level from '
                              '8 cells a side to the resolution, 16 or more, got '
                              f'{len(self.level_channels)} levels, which end at {finest}, and '
                              f'{self.resolution}')


SIZES = {
    'small': OgnConfig(image_channels=(32, 64, 128), code_channels=(256, 256),
                       level_channels=(48, 32, 16)),
    'published': OgnConfig(image_channels=(64, 128, 256), code_channels=(1024, 1024),
                           level_channels=(128, 64, 32)),
    'small-64': OgnConfig(image_channels=(32, 64, 128), code_channels=(256, 256),
                          level_channels=(48, 32, 16, 8), resolution=64),
    'published-64': OgnConfig(image_channels=(64, 128, 256), code_channels=(1024, 1024),
                              level_channels=(128, 64, 32, 32), resolution=64),
}


class Division(nn.Module):
    """
    Mixed cells' features (M, C) to those of their children (8 M, C').

    A transposed convolution of stride and kernel 2, which is a linear map to eight children, then
    a 3 x 3 x 3 convolution over all cells of the new level. Above 32 cells a side it is 1 x 1 x 1,
    since an untrained network, which divides every cell, would have to find the neighbours of
    262,144 cells of each object. The features of each cell are normalised on their own, so that
    no cell depends on which others exist.
    """

    def __init__(self, in_channels: int, out_channels: int, side: int) -> None:
        super().__init__()
        self.side, self._out_channels = side, out_channels
        self.divide = nn.Linear(in_channels, 8 * out_channels)
        self.divided = nn.Sequential(nn.GroupNorm(1, out_channels), nn.ReLU())
        self.convolve = (SparseConv3d(out_channels, out_channels) if side <= _FINEST_CONVOLVED
                         else nn.Linear(out_channels, out_channels))
        self.convolved = nn.Sequential(nn.GroupNorm(1, out_channels), nn.ReLU())

    def forward(self, features: Tensor, cells: Tensor, batch: int) -> Tensor:
        """Return the features of the children, whose cells (8 M, 4) are given."""
        grown = self.divided(self.divide(features).reshape(len(cells), self._out_channels))
        if isinstance(self.convolve, SparseConv3d):
            grown = self.convolve(grown, neighbours_of(cells, batch, self.side))
        else:
            grown = self.convolve(grown)
        result: Tensor = self.convolved(grown)
        return result


class Level(NamedTuple):
    """The cells of a level, (N, 4), their features (N, C) and their states' logits (N, 3 or 2)."""

    cells: Tensor
    features: Tensor
    logits: Tensor


class Ogn(MeanCodeNetwork):
    """
    An octree decoder, sparse at every level: only mixed cells have children.

    Tatarchenko et al. 2017, "Octree Generating Networks: Efficient Convolutional Architectures for
    High-resolution 3D Outputs". Dense up to 8 cells a side; from there on every level says of each
    of its cells whether it is empty, filled or mixed, and divides the mixed ones: those of the
    truth in training (their OGN-known), those predicted otherwise (OGN-pred). The last level
    knows no mixed cells. Several views are decoded from the mean of their codes. The encoder is
    that of Yan et al. 2016, for images of 64 pixels, and the widths of the published sizes are
    chosen to go with it; layers are normalised, as in the paper's network here.
    """

    runs_in_torch_alone = 'how many cells it computes depends on the object'

    def __init__(self, encoder: ImageEncoder, code_channels: int,
                 level_channels: tuple[int, ...]) -> None:
        super().__init__(encoder)
        self.level_channels = level_channels
        coarsest, half = level_channels[0], COARSEST // 2
        self.resolution = COARSEST * 2 ** (len(level_channels) - 1)
        self.dense = nn.Sequential(
            nn.Linear(code_channels, coarsest * half ** 3),
            nn.Unflatten(1, (coarsest, *(half,) * 3)), group_norm(coarsest), nn.ReLU(),
            nn.ConvTranspose3d(coarsest, coarsest, 4, stride=2, padding=1), group_norm(coarsest),
            nn.ReLU())
        self.divisions = nn.ModuleList(
            Division(before, after, COARSEST * 2 ** level)
            for level, (before, after) in enumerate(pairwise(level_channels), start=1))
        self.classify = nn.ModuleList(
            [*(nn.Linear(channels, 3) for channels in level_channels[:-1]),
             nn.Linear(level_channels[-1], 2)])

    @classmethod
    def from_config(cls, config: OgnConfig) -> 'Ogn':
        """Build the network of a configuration, with fresh weights."""
        return cls(ImageEncoder(config.image_channels, config.code_channels),
                   config.code_channels[-1], config.level_channels)

    def levels(self, codes: Tensor, truth: Sequence[Tensor] | None = None) -> Iterator[Level]:
        """
        Yield the levels of the octrees of codes (B, D), from the coarsest on.

        Cells that are mixed by the truth, each level's dense states, are divided; without it those
        that are mixed by their own logits. Where none is, the levels end.
        """
        cells = all_cells(len(codes), COARSEST, codes.device)
        features = self.dense(codes).permute(0, 2, 3, 4, 1).flatten(0, 3)
        logits = self.classify[0](features)
        yield Level(cells, features, logits)
        for index, division in enumerate(self.divisions):
            states = logits.argmax(dim=1) if truth is None else at(truth[index], cells)
            mixed = states == MIXED
            if not mixed.any():
                return
            cells = children_of(cells[mixed])
            features = division(features[mixed], cells, len(codes))
            logits = self.classify[index + 1](features)
            yield Level(cells, features, logits)

    def decode(self, state: State) -> Tensor:
        """Return log-odds of filled against empty where a cell's division ended, (B, R, R, R)."""
        codes = state['latent'].flatten(1)
        levels = ((level.cells, (level.logits[:, FILLED] - level.logits[:, EMPTY]).float())
                  for level in self.levels(codes))
        return expand(levels, len(codes), self.resolution)

    def objective(self, state: State, voxels: Tensor) -> Tensor:
        """
        Return the sum of the levels' cross entropies of the mean codes against (B, R, R, R).

        Raises ConfigError on voxels of another resolution.
        """
        if voxels.shape[-1] != self.resolution:
            raise ConfigError(f'wrong resolution: expected voxels of {self.resolution} cells a '
                              f'side for this size of the network, got {voxels.shape[-1]}; choose '
                              'another size')
        truth, codes = states_of(voxels), state['latent'].flatten(1)
        return torch.stack([
            functional.cross_entropy(level.logits.float(), at(known, level.cells))
            for level, known in zip(self.levels(codes, truth), truth, strict=False)]).sum()


@torch.no_grad()
def octree_report(network: Ogn, codes: Tensor) -> dict[str, dict[int, float]]:
    """
    Return what the octrees of codes (B, D) hold per object, by the cells a side of each level.

    `cells` and `bytes` (one float32 feature vector for each cell); `dense_cells` and `dense_bytes`
    are those of a decoder of the same widths that is dense. A level that no tree reaches has 0.
    """
    report: dict[str, dict[int, float]] = {
        'cells': {}, 'dense_cells': {}, 'bytes': {}, 'dense_bytes': {}}
    levels = [len(level.cells) / len(codes) for level in network.levels(codes)]
    for index, channels in enumerate(network.level_channels):
        side = COARSEST * 2 ** index
        size = _FLOAT_BYTES * channels
        cells = levels[index] if index < len(levels) else 0.0
        report['cells'][side], report['bytes'][side] = cells, cells * size
        report['dense_cells'][side], report['dense_bytes'][side] = side ** 3, side ** 3 * size
    return report
