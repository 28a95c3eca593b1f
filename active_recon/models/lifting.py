"""The lifting network: any cameras, image features lifted along their rays into the cells."""

from dataclasses import dataclass
from typing import Any

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.lifted import (
    aggregate,
    child_matrices,
    GeometricLift,
    initial_statistics,
    Lift,
    projected,
    projection,
    sampled,
    summarise,
)
from active_recon.models.lifting_decoder import Decoded, FINE_SIDE, HullUnet
from active_recon.models.lifting_encoder import (
    FINE,
    IMAGE_SIZE,
    Maps,
    NO_EVIDENCE,
    PyramidEncoder,
)
from active_recon.models.network import Cameras, init_occupancy_bias, ReconstructionNetwork, State
from active_recon.models.visibility import add_visible, visible_mean
from active_recon.models.volume_unet import depth_to_space
import torch
from torch import Tensor
from torch.nn import functional

COARSE_SIDE = 16
_LATENT_SIDE = 4
_COUNTS = 12
_STATISTICS = ('count', 'sum', 'sum_squares', 'max', 'min')


@dataclass(frozen=True)
class LiftingConfig(Config):
    """
    Sizes of the lifting network.

    - encoder_channels: at 64, 32, 16 and 8 pixels a side; pyramid_channels: of its upward path;
      encoder_depth: residual blocks at 16 and at 8 pixels
    - coarse_hidden, coarse_channels: of the features lifted to 16 cells a side; fine_channels: of
      those lifted to 32
    - volume_channels: at 16, 8 and 4 cells; head_channels: at 32
    - visibility: whether the decoder also gets a mean of the features at 16 cells that is weighted
      by how well each view shows a cell
    """

    encoder_channels: tuple[int, int, int, int] = (16, 48, 96, 160)
    pyramid_channels: int = 32
    coarse_hidden: int = 48
    coarse_channels: int = 32
    fine_channels: int = 8
    volume_channels: tuple[int, int, int] = (40, 80, 128)
    head_channels: int = 16
    visibility: bool = False
    encoder_depth: int = 1

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        sizes = [size for name, value in self.to_dict().items() if name != 'visibility'
                 for size in (value if isinstance(value, tuple) else (value,))]
        if min(sizes) < 1:
            raise ConfigError('LiftingConfig: invalid channels: expected 1 or more, got '
                              f'{min(sizes)}')

    def to_dict(self) -> dict[str, Any]:
        """Return the plain mapping; without what is as in weights that do not name it."""
        values = super().to_dict()
        if not self.visibility:
            del values['visibility']
        if self.encoder_depth == 1:
            del values['encoder_depth']
        return values


SIZES = {
    'small': LiftingConfig(),
    'small-visibility': LiftingConfig(visibility=True),
    'large': LiftingConfig(
        encoder_channels=(32, 64, 128, 256), encoder_depth=2, pyramid_channels=64,
        coarse_hidden=64, coarse_channels=64, fine_channels=16, volume_channels=(64, 128, 192),
        head_channels=32),
    'published': LiftingConfig(
        encoder_channels=(24, 64, 128, 192), pyramid_channels=48, coarse_hidden=64,
        coarse_channels=48, fine_channels=12, volume_channels=(48, 96, 160), head_channels=24)}


class Lifting(ReconstructionNetwork):
    """
    Lifts each view's features to the cells that project onto them; decodes statistics over views.

    The state has a fixed size and does not depend on the order of the views: count, sum, sum of
    squares, maximum and minimum of the lifted features at 16 and 32 cells a side; the lowest and
    the second lowest foreground logits at the projections of the 8 cells in each cell at 32,
    less 6 (`hull`); and the number of views, by which the calibration is chosen. With
    `visibility`, each view and cell at 16 also get a logit, and the state two sums more (see
    `add_visible`). `foreground`, (B, 2, 64, 64), is what the last view showed: the foreground's
    probability and the share of each pixel that was seen; the occupancy does not depend on it.
    All of it is 0 before the first view, and cells that a camera does not see (outside its image,
    behind it) stay as they are.
    The network needs no front.
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 64, False

    def __init__(self, encoder: PyramidEncoder, coarse: GeometricLift, fine: Lift,
                 decoder: HullUnet, coarse_channels: int, fine_channels: int,
                 visibility: bool = False) -> None:
        super().__init__()
        self.encoder, self.coarse, self.fine, self.decoder = encoder, coarse, fine, decoder
        self._coarse_channels, self._fine_channels = coarse_channels, fine_channels
        self._visibility = visibility
        # After 1, 2, ... views (the last for all more): logit scale, hull weight, bias
        self.calibration: Tensor
        self.register_buffer('calibration', torch.tensor([1.0, 0, 0]).repeat(_COUNTS, 1))

    @classmethod
    def from_config(cls, config: LiftingConfig) -> 'Lifting':
        """Build the network of a configuration, with fresh weights."""
        encoder = PyramidEncoder(config.encoder_channels, config.pyramid_channels,
                                 config.coarse_hidden, config.fine_channels,
                                 config.encoder_depth)
        summaries = 5 if config.visibility else 4
        decoder = HullUnet(summaries * config.coarse_channels + 1, 4 * config.fine_channels + 1,
                           config.volume_channels, config.head_channels)
        init_occupancy_bias(decoder.logit_32.bias)
        lifted = config.coarse_channels + config.visibility  # a logit beside the features
        return cls(
            encoder, GeometricLift(COARSE_SIDE, config.coarse_hidden, lifted), Lift(FINE_SIDE),
            decoder, config.coarse_channels, config.fine_channels, config.visibility)

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: nothing seen."""
        device = self.device
        coarse = initial_statistics(batch, self._coarse_channels, COARSE_SIDE, device)
        fine = initial_statistics(batch, self._fine_channels, FINE_SIDE, device)
        visible = {'visible_weight': coarse['count'], 'visible_sum': coarse['sum']}
        return {'views': torch.zeros(batch, 1, device=device),
                **_named('coarse', coarse), **_named('fine', fine),
                **(visible if self._visibility else {}),
                'hull': torch.zeros(batch, 16, *(FINE_SIDE,) * 3, device=device),
                'foreground': torch.zeros(batch, 2, FINE, FINE, device=device),
                'latent': torch.zeros(batch, self._coarse_channels, _LATENT_SIDE, _LATENT_SIDE,
                                      device=device)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' maps in one, (B, F); see `Maps`."""
        return self.maps(images).packed()

    def maps(self, images: Tensor) -> Maps:
        """Return the maps of images (B, 3 or 4, 128, 128); channel 4 is `seen`."""
        maps: Maps = self.encoder(images)
        return maps

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state with one more view of each object."""
        maps = Maps.unpacked(encoded, self.coarse.mix.in_channels, self._fine_channels)
        return self.update_from_maps(maps, cameras, state)

    def update_from_maps(self, maps: Maps, cameras: Cameras, state: State) -> State:
        """
        Return the state with T more views of B objects, by their maps and cameras (T * B, ...).

        The result is that of T updates by one view each, up to the rounding of sums.
        """
        matrices = projection(cameras, IMAGE_SIZE)
        batch = len(state['hull'])
        coarse, inside = (each.unflatten(0, (-1, batch)) for each in self.coarse(
            maps.coarse, functional.avg_pool2d(maps.seen, 2), cameras, matrices))
        fine = (each.unflatten(0, (-1, batch)) for each in self.fine(
            maps.fine, maps.seen, cameras, matrices))
        features = coarse[:, :, :self._coarse_channels]
        logits = coarse[:, :, self._coarse_channels:]  # none without visibility
        at_16 = aggregate(_of('coarse', state), features, inside)
        mean = at_16['sum'] / at_16['count'].clamp(min=1)
        showing = inside.amax(dim=3).sum(dim=0)  # (B, 1)
        return {'views': state['views'] + showing,
                **_named('coarse', at_16), **_named('fine', aggregate(_of('fine', state), *fine)),
                **self._visible(state, features, logits, inside),
                'hull': self._carved(maps.foreground, matrices, state['hull']),
                'foreground': maps.shown()[-batch:] * inside[-1].amax(dim=2)[..., None, None],
                'latent': functional.avg_pool2d(mean.mean(dim=4), COARSE_SIDE // _LATENT_SIDE)}

    def decode(self, state: State) -> Tensor:
        """
        Return the occupancy's logits, calibrated by the number of views, (B, 64, 64, 64).

        That is Platt scaling with a second input: scale * logit + weight * evidence + bias, where
        the evidence is the log of the lowest foreground probability over the views.
        """
        count = (state['views'][:, 0].long() - 1).clamp(0, _COUNTS - 1)
        scale, weight, bias = self.calibration[count].T[..., None, None, None, None]
        found = self.logits(state)
        return depth_to_space(scale * found.logits + weight * found.evidence + bias)[:, 0]

    def logits(self, state: State) -> Decoded:
        """Return what the decoder gives, before calibration."""
        coarse, coarse_rest = summarise(_of('coarse', state))
        if self._visibility:
            visible = visible_mean(state['visible_weight'], state['visible_sum'])
            coarse_rest = torch.cat([coarse_rest, visible], dim=1)
        found: Decoded = self.decoder((coarse, coarse_rest), summarise(_of('fine', state)),
                                      state['hull'] + NO_EVIDENCE)
        return found

    def _load_from_state_dict(self, state_dict: dict[str, Any], prefix: str, *rest: Any) -> None:
        """Load a state; weights of version 0.1 have one temperature for each number of views."""
        temperatures = state_dict.pop(f'{prefix}temperatures', None)
        if temperatures is not None:
            none = torch.zeros_like(temperatures)
            state_dict[f'{prefix}calibration'] = torch.stack(
                [1 / temperatures, none, none], dim=1)
        super()._load_from_state_dict(state_dict, prefix, *rest)

    def _visible(self, state: State, features: Tensor, logits: Tensor, inside: Tensor) -> State:
        """Return the sums by visibility with T more views, (T, B, ..., N); {} without."""
        if not self._visibility:
            return {}
        weight, total = add_visible(state['visible_weight'], state['visible_sum'], features,
                                    logits, inside)
        return {'visible_weight': weight, 'visible_sum': total}

    @torch.no_grad()
    def _carved(self, foreground: Tensor, matrices: Tensor, hull: Tensor) -> Tensor:
        """Return `hull` updated by the foreground logits of T more views, (T * B, 1, h, w)."""
        where, depth = projected(child_matrices(matrices, FINE_SIDE), FINE_SIDE)
        where = where.reshape(len(foreground), -1, 2)  # (T * B, 8 * 32 ** 3, 2)
        # Zeros come in beyond the image, where there is no evidence
        found = sampled(foreground.float().clamp(-NO_EVIDENCE, NO_EVIDENCE) - NO_EVIDENCE, where)
        found = torch.where(depth.reshape(found.shape) > 0, found, 0)
        least, second = hull[:, :8], hull[:, 8:]
        for each in torch.split(found, len(hull)):
            new = each.reshape(least.shape)  # (B, 8, 32, 32, 32)
            least, second = torch.minimum(least, new), torch.minimum(
                second, torch.maximum(least, new))
        return torch.cat([least, second], dim=1)


def _named(part: str, statistics: dict[str, Tensor]) -> State:
    return {f'{part}_{name}': statistics[name] for name in _STATISTICS}


def _of(part: str, state: State) -> State:
    return {name: state[f'{part}_{name}'] for name in _STATISTICS}
