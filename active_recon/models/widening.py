"""The weights of a lifting network in a wider and deeper one, which gives nearly the same."""

from dataclasses import dataclass, replace
from typing import Any

from active_recon.errors import ConfigError
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.weights import Bundle
import torch
from torch import Tensor

_GROUPS = 8  # of the group normalisations
_APART = 0.02  # noise of what is there twice, in standard deviations of the layer's weights
_STATISTICS = 4  # mean, deviation, maximum and minimum over the views
_BLOCKS = 8  # cells in one


@dataclass(frozen=True, eq=False)
class _Channels:
    """
    Channels that a wider layer has instead of those of a narrower one.

    - source: (N,), the narrower layer's channel that each is a copy of
    - share: (N,), of what the next layer adds up of that channel; 1 in total for each source
    """

    source: Tensor
    share: Tensor

    @property
    def narrow(self) -> int:
        """The number of the narrower layer's channels."""
        return int(self.source.max()) + 1

    def stacked(self, count: int) -> '_Channels':
        """Return the channels of `count` such layers one after the other."""
        first = torch.arange(count)[:, None] * self.narrow
        return _Channels((first + self.source).flatten(), self.share.repeat(count))

    def split(self, count: int) -> '_Channels':
        """Return each channel as `count` neighbours, as `depth_to_space` reads them."""
        parts = self.source[:, None] * count + torch.arange(count)
        return _Channels(parts.flatten(), self.share.repeat_interleave(count))

    def followed_by(self, count: int) -> '_Channels':
        """Return these and then `count` channels that are as many as before."""
        return _Channels(torch.cat([self.source, self.narrow + torch.arange(count)]),
                         torch.cat([self.share, torch.ones(count)]))


def _same(count: int) -> _Channels:
    return _Channels(torch.arange(count), torch.ones(count))


class _Widening:
    """Draws which channels are doubled, and collects the wider layers by their names."""

    def __init__(self, narrow: dict[str, Tensor], seed: int) -> None:
        self._narrow, self._rng = narrow, torch.Generator().manual_seed(seed)
        self.wide: dict[str, Tensor] = {}

    def channels(self, before: int, after: int, groups: int = 1) -> _Channels:
        """Return `after` channels of `before`: each, and some of every group a second time."""
        own, wanted = before // groups, after // groups
        if before % groups or after % groups or not own <= wanted <= 2 * own:
            raise ConfigError(f'{before} channels cannot be widened to {after}: expected at least '
                              f'as many, at most twice as many, and multiples of {groups}')
        source = torch.cat([group * own + torch.cat([
            torch.arange(own), torch.randperm(own, generator=self._rng)[:wanted - own]])
            for group in range(groups)])
        raw = 0.5 + 0.5 * torch.rand(after, generator=self._rng)
        total = torch.zeros(before).index_add(0, source, raw)
        return _Channels(source, raw / total[source])

    def grouped(self, before: int, after: int) -> _Channels:
        """Return channels that are normalised in the same groups as before."""
        return self.channels(before, after, _GROUPS)

    def inputs(self, name: str) -> _Channels:
        """Return the inputs of a layer, where they stay as many."""
        return _same(self._narrow[f'{name}.weight'].shape[1])

    def outputs(self, name: str) -> _Channels:
        """Return the outputs of a layer, where they stay as many."""
        return _same(self._narrow[f'{name}.weight'].shape[0])

    def layer(self, name: str, given: _Channels, found: _Channels) -> None:
        """Widen a linear layer or a convolution; copies become a little different."""
        narrow = self._narrow[f'{name}.weight']
        along = [1] * (narrow.dim() - 2)
        wide = narrow[found.source][:, given.source] * given.share.reshape(1, -1, *along)
        twice = torch.bincount(found.source)[found.source] > 1
        apart = _APART * narrow.std() * torch.randn(wide.shape, generator=self._rng)
        self.wide[f'{name}.weight'] = wide + apart * twice.reshape(-1, 1, *along)
        self.wide[f'{name}.bias'] = self._narrow[f'{name}.bias'][found.source]

    def norm(self, name: str, channels: _Channels) -> None:
        """Widen the factors of a normalisation."""
        for part in ('weight', 'bias'):
            self.wide[f'{name}.{part}'] = self._narrow[f'{name}.{part}'][channels.source]

    def keep(self, name: str) -> None:
        """Take a layer or a number as it is."""
        self.wide |= {key: tensor for key, tensor in self._narrow.items()
                      if key == name or key.startswith(f'{name}.')}

    def residual(self, name: str, channels: _Channels, depth: int = 2) -> None:
        """Widen convolutions, each with normalisation and ReLU after it, beside the identity."""
        given = channels
        for left in reversed(range(depth)):
            place = 3 * (depth - 1 - left)
            found = self.grouped(channels.narrow, len(channels.source)) if left else channels
            self.layer(f'{name}.layers.{place}', given, found)
            self.norm(f'{name}.layers.{place + 1}', found)
            given = found


def widened(bundle: Bundle, sizes: LiftingConfig, seed: int = 0) -> Bundle:
    """
    Return a lifting network of larger sizes that gives nearly what the bundle's gives.

    Channels that are there twice share what they add to the next layer unevenly, and differ a
    little, so that they can learn different things (Net2Net, Chen et al. 2016). Residual blocks
    more begin as the identity. Raises ConfigError where a size is smaller than before or more
    than twice as large, and where the network is no lifting network or weighs by visibility.
    """
    before = bundle.config
    if not isinstance(before, LiftingConfig):
        raise ConfigError(f'{bundle.model}: cannot be widened: expected a lifting network')
    if before.visibility or sizes.visibility or sizes.encoder_depth < before.encoder_depth:
        raise ConfigError('cannot be widened: expected no visibility, and an encoder at least as '
                          f'deep as before, got {sizes}')
    narrow = {name: tensor.float() for name, tensor in bundle.reconstruction.state_dict().items()}
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)  # what is new is the same each time: trainings are resumed
        network = Lifting.from_config(sizes)
    state = network.state_dict()
    given = _Widening(narrow, seed)
    coarse, fine = _widen_encoder(given, before, sizes)
    _widen_decoder(given, before, sizes, coarse, fine)
    given.keep('calibration')
    for name, fresh in state.items():
        if name in given.wide:
            state[name] = given.wide[name]
        elif '.layers.4.' in name:  # the last normalisation of a residual block more
            state[name] = torch.zeros_like(fresh)
    network.load_state_dict(state)
    card: dict[str, Any] = {**bundle.card, 'widened_from': before.to_dict()}
    return replace(bundle, reconstruction=network, config=sizes, card=card)


def _widen_encoder(given: _Widening, before: LiftingConfig,
                   sizes: LiftingConfig) -> tuple[_Channels, _Channels]:
    """Widen the encoder and the lift; return the channels lifted to 16 and to 32 cells."""
    name = 'encoder.'
    pairs = list(zip(before.encoder_channels, sizes.encoder_channels, strict=True))
    inner, at_64 = given.channels(*pairs[0]), given.channels(*pairs[0])
    given.layer(f'{name}down_64.0', given.inputs(f'{name}down_64.0'), inner)
    given.layer(f'{name}down_64.2', inner, at_64)
    sides = {64: at_64}
    for side, pair in zip((32, 16, 8), pairs[1:], strict=True):
        sides[side] = given.grouped(*pair)
        given.layer(f'{name}down_{side}.0.0', sides[2 * side], sides[side])
        given.norm(f'{name}down_{side}.0.1', sides[side])
        for block in range(1, 1 + (before.encoder_depth if side < 32 else 1)):
            given.residual(f'{name}down_{side}.{block}', sides[side])
    given.layer(f'{name}whole', sides[8], sides[8])
    width = (before.pyramid_channels, sizes.pyramid_channels)
    half = (width[0] // 2, width[1] // 2)
    added_16, up_16, up_32 = (given.channels(*width) for _ in range(3))
    added_64, up_64 = (given.channels(*half) for _ in range(2))
    given.layer(f'{name}up_8', sides[8], added_16)
    given.layer(f'{name}lateral_16', sides[16], added_16)
    given.layer(f'{name}smooth_16.0', added_16, up_16)
    given.layer(f'{name}lateral_32', sides[32], up_16)  # is added to what comes from 16 pixels
    given.layer(f'{name}smooth_32.0', up_16, up_32)
    given.layer(f'{name}up_32', up_32, added_64)
    given.layer(f'{name}lateral_64', at_64, added_64)
    given.layer(f'{name}smooth_64.0', added_64, up_64)
    given.layer(f'{name}silhouette', up_64, given.outputs(f'{name}silhouette'))
    given.keep(f'{name}shown_128')
    given.keep(f'{name}foreground')
    hidden = given.channels(before.coarse_hidden, sizes.coarse_hidden)
    fine = given.channels(before.fine_channels, sizes.fine_channels)
    given.layer(f'{name}coarse', up_32.followed_by(1), hidden)
    given.layer(f'{name}fine', up_64.followed_by(4), fine)
    of_geometry = given.channels(before.coarse_hidden, sizes.coarse_hidden)
    given.layer('coarse.geometry.0', given.inputs('coarse.geometry.0'), of_geometry)
    given.layer('coarse.geometry.2', of_geometry, hidden)
    coarse = given.channels(before.coarse_channels, sizes.coarse_channels)
    given.layer('coarse.mix', hidden, coarse)
    return coarse, fine


def _widen_decoder(given: _Widening, before: LiftingConfig, sizes: LiftingConfig,
                   coarse: _Channels, fine: _Channels) -> None:
    name = 'decoder.'
    at_16, at_8, at_4 = (given.grouped(*pair) for pair in zip(
        before.volume_channels, sizes.volume_channels, strict=True))
    entered, head = (given.channels(before.head_channels, sizes.head_channels) for _ in range(2))
    given.layer(f'{name}fine_in.0', fine.stacked(_STATISTICS).followed_by(1 + _BLOCKS), entered)
    blocks = entered.split(_BLOCKS)
    statistics = coarse.stacked(_STATISTICS).followed_by(1)
    given.layer(f'{name}enter.0', _Channels(
        torch.cat([statistics.source, statistics.narrow + blocks.source]),
        torch.cat([statistics.share, blocks.share])), at_16)
    given.norm(f'{name}enter.1', at_16)
    for part, channels, depth in (('down_16', at_16, 1), ('down_8', at_8, 2), ('at_4', at_4, 2),
                                  ('up_8', at_8, 2), ('up_16', at_16, 2)):
        given.residual(f'{name}{part}', channels, depth)
    for part, finer, coarser in (('to_8', at_16, at_8), ('to_4', at_8, at_4)):
        given.layer(f'{name}{part}.0', finer, coarser)
        given.norm(f'{name}{part}.1', coarser)
    given.layer(f'{name}from_4', at_4, at_8.split(_BLOCKS))
    given.layer(f'{name}from_8', at_8, at_16.split(_BLOCKS))
    given.layer(f'{name}to_32', at_16, head.split(_BLOCKS))
    given.layer(f'{name}skip_32', entered, head)
    for part in ('to_64', 'logit_32'):
        given.layer(f'{name}{part}', head, given.outputs(f'{name}{part}'))
