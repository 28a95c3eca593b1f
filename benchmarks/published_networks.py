"""
Networks of other papers at their published sizes, and the default network, in one run.

Pix2Vox-F and 3D-RETR-S are written here from their papers, to be timed: their weights are random.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise

from active_recon.geometry.cameras import orbit_camera
from active_recon.models.network import Cameras
from active_recon.models.registry import network_config, network_entry
from active_recon.runtimes import load_runtime
from benchmarks.figures import Figure, interleaved
import numpy as np
import torch
from torch import nn, Tensor

_THREADS, _REPEATS = 1, 10  # one thread, as in the nodes
_OURS = 'default network, 64 cells, openvino'


class Pix2VoxF(nn.Module):
    """
    Pix2Vox-F for one view: images (B, 3, 224, 224) to occupancies (B, 32, 32, 32).

    Xie et al. 2019, "Pix2Vox: Context-aware 3D Reconstruction from Single and Multi-view Images":
    the first nine convolutions of VGG16, three more, five transposed ones, and the score of each
    cell by which views are merged. Its variant F has no refiner.
    """

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for block in ((3, 64, 64), (64, 128, 128), (128, 256, 256, 256), (256, 512, 512)):
            layers += [nn.MaxPool2d(2)] if layers else []
            for before, after in pairwise(block):
                layers += [nn.Conv2d(before, after, 3, padding=1), nn.BatchNorm2d(after),
                           nn.ReLU()]
        self.encoder = nn.Sequential(
            *layers, nn.Conv2d(512, 512, 1), nn.BatchNorm2d(512), nn.ELU(),
            nn.Conv2d(512, 256, 3), nn.BatchNorm2d(256), nn.ELU(), nn.MaxPool2d(4),
            nn.Conv2d(256, 128, 3), nn.BatchNorm2d(128), nn.ELU())
        self.decoder = nn.Sequential(*(
            nn.Sequential(nn.ConvTranspose3d(before, after, 4, stride=2, padding=1, bias=False),
                          nn.BatchNorm3d(after), nn.ReLU())
            for before, after in pairwise((256, 128, 64, 32, 8))))
        self.to_occupancy = nn.Sequential(nn.ConvTranspose3d(8, 1, 1), nn.Sigmoid())
        self.score = nn.Sequential(*(
            nn.Sequential(nn.Conv3d(before, after, 3, padding=1), nn.BatchNorm3d(after),
                          nn.LeakyReLU(0.2)) for before, after in pairwise((9, 16, 8, 4, 2, 1))))

    def forward(self, images: Tensor) -> Tensor:
        """Return the occupancies of one view, merged with no other."""
        features = self.decoder(self.encoder(images).reshape(len(images), 256, 2, 2, 2))
        occupancy = self.to_occupancy(features)
        scores = self.score(torch.cat([features, occupancy], dim=1))[:, None].softmax(dim=1)
        merged: Tensor = (scores * occupancy[:, None]).sum(dim=1)[:, 0]
        return merged


class _Residual(nn.Module):
    """Convolutions of 3, 3 and 1 cells and a shortcut around them; (B, C, *grid) stays so."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.change = nn.Sequential(
            nn.Conv3d(channels, channels, 3, padding=1), nn.ReLU(),
            nn.Conv3d(channels, channels, 3, padding=1), nn.ReLU(),
            nn.Conv3d(channels, channels, 1))

    def forward(self, features: Tensor) -> Tensor:
        changed: Tensor = features + self.change(features)
        return changed


class RetrS(nn.Module):
    """
    3D-RETR-S for one view: images (B, 3, 224, 224) to occupancies (B, 32, 32, 32).

    Shi et al. 2021, "3D-RETR: End-to-End Single and Multi-View 3D Reconstruction with
    Transformers": the encoder of DeiT-Tiny, six layers of decoder for 64 patches of the volume,
    and convolutions of 64 channels that make 32 cells of 4.
    """

    _WIDTH, _HEADS, _PATCHES = 192, 3, 4

    def __init__(self) -> None:
        super().__init__()
        width = self._WIDTH
        options = {'nhead': self._HEADS, 'dim_feedforward': 4 * width, 'dropout': 0.0,
                   'activation': 'gelu', 'batch_first': True, 'norm_first': True}
        self.patches = nn.Conv2d(3, width, 16, stride=16)
        self.extra = nn.Parameter(torch.randn(1, 2, width))  # its class and distillation tokens
        self.places = nn.Parameter(torch.randn(1, 14 ** 2 + 2, width))
        self.encoder = nn.TransformerEncoder(
            nn.TransformerEncoderLayer(width, **options), 12, nn.LayerNorm(width),
            enable_nested_tensor=False)
        self.queries = nn.Parameter(torch.randn(1, self._PATCHES ** 3, width))
        self.decoder = nn.TransformerDecoder(
            nn.TransformerDecoderLayer(width, **options), 6, nn.LayerNorm(width))
        ups = [each for _ in range(3) for each in (
            nn.ConvTranspose3d(64, 64, 4, stride=2, padding=1), nn.ReLU())]
        self.to_occupancy = nn.Sequential(
            nn.Conv3d(width, 64, 1), _Residual(64), _Residual(64), *ups, nn.Conv3d(64, 1, 1),
            nn.Sigmoid())

    def forward(self, images: Tensor) -> Tensor:
        """Return the occupancies of one view."""
        count, grid = len(images), (self._PATCHES,) * 3
        tokens = self.patches(images).flatten(2).transpose(1, 2)
        tokens = torch.cat([self.extra.expand(count, -1, -1), tokens], dim=1) + self.places
        found = self.decoder(self.queries.expand(count, -1, -1), self.encoder(tokens))
        occupancy: Tensor = self.to_occupancy(
            found.transpose(1, 2).reshape(count, self._WIDTH, *grid))[:, 0]
        return occupancy


def published_figures() -> list[Figure]:
    """Time one view of each network in turns, batch 1, on the same threads."""
    torch.set_num_threads(_THREADS)
    with torch.inference_mode():
        samples = interleaved({
            '3D-R2N2, 32 cells': _of_registry('r2n2'), 'PTN, 32 cells': _of_registry('ptn'),
            'Pix2Vox-F, 32 cells': _of_pixels(Pix2VoxF()),
            '3D-RETR-S, 32 cells': _of_pixels(RetrS()), _OURS: _ours()}, _REPEATS)
    ours = samples.pop(_OURS)
    middle = float(np.median(ours))
    return [Figure(f'a view, {_OURS}, {_THREADS} thread', 'ms', ours, 4), *(
        Figure(f'the same, {name}', 'times as long', [each / middle for each in times], 20,
               more_is_better=True) for name, times in samples.items())]


def _of_registry(name: str) -> Callable[[], object]:
    network = network_entry(name).build(network_config(name, 'published')).eval()
    images = torch.zeros(1, 3, network.image_size, network.image_size)
    cameras = Cameras.of([orbit_camera(0.5)])
    return lambda: network(images, cameras, network.initial_state(1))


def _of_pixels(network: nn.Module) -> Callable[[], object]:
    network.eval()
    images = torch.zeros(1, 3, 224, 224)
    return lambda: network(images)


def _ours() -> Callable[[], object]:
    runtime = load_runtime(threads=_THREADS)
    size = runtime.spec.image_size
    image: Sequence[object] = (np.zeros((size, size, 3), np.uint8), orbit_camera(0.5))
    return lambda: runtime.step(*image, runtime.initial_state())
