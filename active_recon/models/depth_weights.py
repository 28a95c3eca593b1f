"""A depth refiner's weights: a file of their own beside those of the network they belong to."""

from pathlib import Path
from typing import Any

from active_recon.errors import WeightsError
from active_recon.models.companion_weights import Companion
from active_recon.models.depth_refiner import DepthRefiner, DepthRefinerConfig
from active_recon.models.weights_files import depth_path, SHIPPED, weights_hash


def _build(config: dict[str, Any]) -> DepthRefiner:
    return DepthRefiner.from_config(DepthRefinerConfig.from_dict(config))


_REFINER = Companion(
    'depth-refiner', _build,
    no_such='no depth refiner: expected one that `active-recon train-depth` wrote',
    of_others='depth refiner of other weights',
    advice='train it anew with `active-recon train-depth`', half=True)


def save_refiner(path: Path, refiner: DepthRefiner, config: DepthRefinerConfig,
                 network_sha256: str, card: dict[str, Any]) -> None:
    """Write `path` (.safetensors, half precision) for a network's weights, and the card beside."""
    _REFINER.save(path, refiner, config, network_sha256, card)


def load_refiner(weights: Path | None = None, device: str = 'cpu') -> DepthRefiner:
    """
    Return the depth refiner of a network's weights, in evaluation mode; None: of those that ship.

    Raises WeightsError where there is none beside them, where it is not whole, and where it was
    trained for other weights.
    """
    weights = weights or SHIPPED
    digest, path = weights_hash(weights), depth_path(weights)
    if not path.is_file():
        raise WeightsError(f'{weights.name}: takes no depth: expected {path.name} beside it, '
                           'which `active-recon train-depth` makes')
    return _REFINER.read(path, digest, device)
