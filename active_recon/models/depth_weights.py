"""A depth refiner's weights: a file of their own beside those of the network they belong to."""

import json
from pathlib import Path
from typing import Any

from active_recon.errors import ConfigError, WeightsError
from active_recon.models.depth_refiner import DepthRefiner, DepthRefinerConfig
from active_recon.models.weights_bytes import weights_bytes
from active_recon.models.weights_files import depth_path, SHIPPED, weights_hash
from safetensors import safe_open, SafetensorError
import torch

KIND = 'depth-refiner'


def save_refiner(path: Path, refiner: DepthRefiner, config: DepthRefinerConfig,
                 network_sha256: str, card: dict[str, Any]) -> None:
    """Write `path` (.safetensors, half precision) for a network's weights, and the card beside."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {name: tensor.detach().cpu().half().contiguous()
               for name, tensor in refiner.state_dict().items()}
    path.write_bytes(weights_bytes(tensors, {
        'model': KIND, 'config': json.dumps(config.to_dict()),
        'network_sha256': network_sha256}))
    path.with_suffix('.json').write_text(json.dumps({
        'model': KIND, 'config': config.to_dict(), 'network_sha256': network_sha256,
        'sha256': weights_hash(path), **card}, indent=2) + '\n')


def load_refiner(weights: Path | None = None, device: str = 'cpu') -> DepthRefiner:
    """
    Return the depth refiner of a network's weights, in evaluation mode; None: of those that ship.

    Raises WeightsError where there is none beside them, where it is not whole, and where it was
    trained for other weights.
    """
    weights = weights or SHIPPED
    path, network_sha256 = depth_path(weights), weights_hash(weights)
    if not path.is_file():
        raise WeightsError(f'{weights.name}: takes no depth: expected {path.name} beside it, '
                           'which `active-recon train-depth` makes')
    try:
        with safe_open(path, framework='pt', device=device) as stored:
            facts = stored.metadata() or {}
            tensors = {name: stored.get_tensor(name).float()
                       for name in stored.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{path}: no whole safetensors file: {error}') from error
    if facts.get('model') != KIND:
        raise WeightsError(f'{path}: no depth refiner: expected one that `active-recon '
                           f'train-depth` wrote, got {facts.get("model")!r}')
    if facts.get('network_sha256') != network_sha256:
        raise WeightsError(
            f'{path}: depth refiner of other weights: expected one trained for '
            f'{network_sha256[:12]}, got one for {facts.get("network_sha256", "none")[:12]}; '
            'train it anew with `active-recon train-depth`')
    try:
        with torch.device('meta'):
            refiner = DepthRefiner.from_config(
                DepthRefinerConfig.from_dict(json.loads(facts['config'])))
        refiner.load_state_dict(tensors, assign=True)
    except (KeyError, ValueError, TypeError, RuntimeError, ConfigError) as error:
        raise WeightsError(f'{path}: its tensors do not fit its config: {error}') from error
    refiner.requires_grad_(False)
    return refiner.eval()
