"""The lifting network: any cameras, image features carried along their rays into the cells."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.lifted import (
    gathered,
    Lift,
    Lookup,
    no_views,
    projected,
    projection,
    sampled,
    statistics,
)
from active_recon.models.lifting_decoder import FINE_SIDE, HullUnet
from active_recon.models.lifting_encoder import IMAGE_SIZE, Maps, NO_EVIDENCE, PyramidEncoder
from active_recon.models.network import Cameras, ReconstructionNetwork, start_empty, State
import torch
from torch import Tensor
from torch.nn import functional

_COARSE_SIDE = 16
_LATENT_SIDE = 4
_COUNTS = 12
_STATISTICS = ('count', 'sum', 'square', 'most', 'least')


@dataclass(frozen=True)
class LiftingConfig(Config):
    """
    Sizes of the lifting network.

    - encoder_channels: at 64, 32, 16 and 8 pixels a side; pyramid_channels: of its way up
    - coarse_hidden, coarse_channels: of what 16 cells a side look up; fine_channels: of 32
    - volume_channels: at 16, 8 and 4 cells; head_channels: at 32
    """

    encoder_channels: tuple[int, int, int, int] = (16, 48, 96, 160)
    pyramid_channels: int = 32
    coarse_hidden: int = 48
    coarse_channels: int = 32
    fine_channels: int = 8
    volume_channels: tuple[int, int, int] = (40, 80, 128)
    head_channels: int = 16

    def __post_init__(self) -> None:
        """Refuse sizes that make no network."""
        sizes = [size for value in self.to_dict().values()
                 for size in (value if isinstance(value, tuple) else (value,))]
        if min(sizes) < 1:
            raise ConfigError('LiftingConfig: expected channels of 1 or more, got '
                              f'{min(sizes)}')


SIZES = {'small': LiftingConfig(), 'published': LiftingConfig(
    encoder_channels=(24, 64, 128, 192), pyramid_channels=48, coarse_hidden=64,
    coarse_channels=48, fine_channels=12, volume_channels=(48, 96, 160), head_channels=24)}


class Lifting(ReconstructionNetwork):
    """
    Cells look up each view's features where they project to, and what views agree on is decoded.

    The state is order-free and of one size: how often each cell was seen, and sum, sum of squares,
    maximum and minimum of what was lifted, at 16 and 32 cells a side; at 64, by how much the two
    least logits of the foreground at a cell's projection stay below 6 (`hull`); and the number of
    views, for each of which logits have a temperature of their own. All of it is 0
    before the first view, and what a camera did not see (beyond its image, behind it) adds 0. No
    front is asked for.
    """

    image_size, resolution, needs_front = IMAGE_SIZE, 64, False

    def __init__(self, encoder: PyramidEncoder, coarse: Lift, fine: Lookup,
                 decoder: HullUnet, fine_channels: int) -> None:
        super().__init__()
        self.encoder, self.coarse, self.fine, self.decoder = encoder, coarse, fine, decoder
        self._fine_channels = fine_channels
        self.temperatures: Tensor  # of the logits, after 1, 2, ... views, and more than those
        self.register_buffer('temperatures', torch.ones(_COUNTS))

    @classmethod
    def from_config(cls, config: LiftingConfig) -> 'Lifting':
        """Build the network of a configuration, with fresh weights."""
        encoder = PyramidEncoder(config.encoder_channels, config.pyramid_channels,
                                 config.coarse_hidden, config.fine_channels)
        decoder = HullUnet(4 * config.coarse_channels + 1, 4 * config.fine_channels + 1,
                           config.volume_channels, config.head_channels)
        start_empty(decoder.logit_32.bias)
        return cls(encoder, Lift(_COARSE_SIDE, config.coarse_hidden, config.coarse_channels),
                   Lookup(FINE_SIDE), decoder, config.fine_channels)

    def initial_state(self, batch: int) -> State:
        """Return the state before any view: nothing seen."""
        device = self.device
        coarse = no_views(batch, self.coarse.mix.out_channels, _COARSE_SIDE, device)
        fine = no_views(batch, self._fine_channels, FINE_SIDE, device)
        side = self.resolution
        return {'views': torch.zeros(batch, 1, device=device),
                **_named('coarse', coarse), **_named('fine', fine),
                'hull': torch.zeros(batch, 2, side, side, side, device=device),
                'latent': torch.zeros(batch, self.coarse.mix.out_channels, _LATENT_SIDE,
                                      _LATENT_SIDE, device=device)}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the images' maps in one, (B, F); see `Maps`."""
        return self.maps(images).packed()

    def maps(self, images: Tensor) -> Maps:
        """Return the maps of images (B, 3 or 4, 128, 128); the fourth channel is what was seen."""
        maps: Maps = self.encoder(images)
        return maps

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Let every cell look up what one more view shows of it."""
        return self.look_up(Maps.unpacked(encoded, self.coarse.mix.in_channels,
                                          self._fine_channels), cameras, state)

    def look_up(self, maps: Maps, cameras: Cameras, state: State) -> State:
        """
        Let every cell look up what the maps (T * B, ...) of T views of B objects show of it.

        The result is what T updates by one view would give, to the rounding of sums.
        """
        matrices = projection(cameras, IMAGE_SIZE)
        batch = len(state['hull'])
        coarse = self.coarse(maps.coarse, functional.avg_pool2d(maps.seen, 2), cameras, matrices)
        fine = self.fine(maps.fine, maps.seen, cameras, matrices)
        known = {part: gathered(_of(part, state), *(
            each.unflatten(0, (-1, batch)) for each in found))
            for part, found in (('coarse', coarse), ('fine', fine))}
        rough = known['coarse']['sum'] / known['coarse']['count'].clamp(min=1)
        showing = coarse[1].amax(dim=2).unflatten(0, (-1, batch)).sum(dim=0)  # (B, 1)
        return {'views': state['views'] + showing,
                **_named('coarse', known['coarse']), **_named('fine', known['fine']),
                'hull': self._carved(maps.foreground, matrices, state['hull']),
                'latent': functional.adaptive_avg_pool2d(rough.mean(dim=4), _LATENT_SIDE)}

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits, calibrated by the number of views, (B, 64, 64, 64)."""
        count = (state['views'][:, 0].long() - 1).clamp(0, _COUNTS - 1)
        return self.logits(state)[0] / self.temperatures[count][:, None, None, None]

    def logits(self, state: State) -> tuple[Tensor, Tensor]:
        """Return logits as learned, (B, 64, 64, 64), and rougher ones, (B, 32, 32, 32)."""
        found: tuple[Tensor, Tensor] = self.decoder(
            statistics(_of('coarse', state)), statistics(_of('fine', state)),
            state['hull'] + NO_EVIDENCE)
        return found

    @torch.no_grad()
    def _carved(self, foreground: Tensor, matrices: Tensor, hull: Tensor) -> Tensor:
        """Return `hull` with the logits of the foreground of T more views, (T * B, 1, h, w)."""
        where, depth = projected(matrices, self.resolution)
        # Zeros come in beyond the image, where there is no evidence
        found = sampled(foreground.float().clamp(-NO_EVIDENCE, NO_EVIDENCE) - NO_EVIDENCE, where)
        found = torch.where(depth[:, None] > 0, found, 0)
        least, second = hull[:, :1], hull[:, 1:]
        for new in found.reshape(-1, *least.shape):  # (B, 1, 64, 64, 64)
            least, second = torch.minimum(least, new), torch.minimum(
                second, torch.maximum(least, new))
        return torch.cat([least, second], dim=1)


def _named(part: str, known: dict[str, Tensor]) -> State:
    return {f'{part}_{name}': known[name] for name in _STATISTICS}


def _of(part: str, state: State) -> State:
    return {name: state[f'{part}_{name}'] for name in _STATISTICS}
