"""The segmenter's weights: a file of their own, which serves every network."""

from pathlib import Path
from typing import Any

from active_recon.errors import WeightsError
from active_recon.models.companion_weights import Companion
from active_recon.models.lifting import Lifting
from active_recon.models.segmenter import Segmenter, SegmenterConfig
from active_recon.models.weights import load_weights
from active_recon.models.weights_bytes import misfit
from active_recon.models.weights_files import SEGMENTER


def _build(config: dict[str, Any]) -> Segmenter:
    return Segmenter.from_config(SegmenterConfig.from_dict(config))


_SEGMENTER = Companion(
    'segmenter', _build,
    no_such='no segmenter: expected one that `active-recon train-segmenter` wrote',
    of_others='segmenter of other weights', advice='', half=True)


def save_segmenter(path: Path, segmenter: Segmenter, config: SegmenterConfig,
                   card: dict[str, Any]) -> None:
    """Write `path` (.safetensors, half precision), and the card beside it."""
    _SEGMENTER.save(path, segmenter, config, None, card)


def read_segmenter(path: Path = SEGMENTER, device: str = 'cpu') -> Segmenter:
    """
    Return a segmenter in evaluation mode; by default the one that ships.

    Raises WeightsError where the file is not whole or holds another kind of network.
    """
    return _SEGMENTER.read(path, None, device)


def begin_with(segmenter: Segmenter, path: Path) -> None:
    """
    Let a segmenter begin with the weights of another, or of a lifting network's encoder.

    Raises WeightsError where the file has neither, or of other sizes.
    """
    try:
        if is_segmenter(path):
            segmenter.load_state_dict(read_segmenter(path).state_dict())
            return
        network = load_weights(path).reconstruction
        if not isinstance(network, Lifting):
            raise WeightsError(f'{path}: expected a segmenter or a lifting network to begin with')
        segmenter.begin_with(network.encoder)
    except RuntimeError as error:
        raise WeightsError(f'{path}: of other sizes: expected a segmenter or a lifting network '
                           f'with an encoder like that of lifting, got: {misfit(error)}'
                           ) from error


def is_segmenter(path: Path) -> bool:
    """Return whether a file calls itself a segmenter; False where it cannot be read."""
    return _SEGMENTER.is_kind(path)
