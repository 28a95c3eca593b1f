"""A view scorer's weights: a file of their own beside those of the network that they belong to."""

import json
from pathlib import Path
from typing import Any

from active_recon.errors import ConfigError, WeightsError
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.models.weights import Bundle
from active_recon.models.weights_bytes import weights_bytes
from active_recon.models.weights_files import scorer_path, SHIPPED, weights_hash
from safetensors import safe_open, SafetensorError
import torch
from torch import nn

_KIND = 'view-scorer'


def save_scorer(path: Path, scorer: ViewScorer, config: ScorerConfig, network_sha256: str,
                card: dict[str, Any]) -> None:
    """Write `path` (.safetensors, float32) for a network's weights, and the card beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {name: tensor.detach().cpu().contiguous()
               for name, tensor in scorer.state_dict().items()}
    facts = {'model': _KIND, 'config': json.dumps(config.to_dict()),
             'network_sha256': network_sha256}
    path.write_bytes(weights_bytes(tensors, facts))
    path.with_suffix('.json').write_text(json.dumps({
        'model': _KIND, 'config': config.to_dict(), 'network_sha256': network_sha256,
        'sha256': weights_hash(path), **card}, indent=2) + '\n')


def load_scorer(weights: Path | None = None, device: str = 'cpu') -> ViewScorer:
    """
    Return the scorer of a network's weights, in evaluation mode; None: of those that ship.

    Raises WeightsError where there is none beside them, where it is not whole, and where it was
    trained for other weights: what a view brings depends on the network.
    """
    weights, path = weights or SHIPPED, scorer_path(weights)
    if not path.is_file():
        raise WeightsError(f'{weights.name}: no view policy in these weights or beside them: '
                           f'expected {path.name}, which `active-recon train-policy` makes; take '
                           'the weights of lifting or 2d3d-attention, or a policy that is not '
                           'learned')
    return read_scorer(path, weights_hash(weights), device)


def policy_module(weights: Path, bundle: Bundle) -> nn.Module | None:
    """Return the learned policy in weights that were read, or beside them; None without one."""
    if bundle.attention is not None or not scorer_path(weights).is_file():
        return bundle.attention
    return load_scorer(weights)


def read_scorer(path: Path, network_sha256: str, device: str = 'cpu') -> ViewScorer:
    """Return the scorer in a file, for the network of a hash; raises as `load_scorer`."""
    try:
        with safe_open(path, framework='pt', device=device) as stored:
            facts = stored.metadata() or {}
            tensors = {name: stored.get_tensor(name) for name in stored.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{path}: no whole safetensors file: {error}') from error
    if facts.get('model') != _KIND:
        raise WeightsError(f'{path}: no view scorer: expected one that `active-recon '
                           f'train-policy` wrote, got {facts.get("model")!r}')
    if facts.get('network_sha256') != network_sha256:
        raise WeightsError(
            f'{path}: view policy of other weights: expected one trained for '
            f'{network_sha256[:12]}, got one for {facts.get("network_sha256", "none")[:12]}; '
            'train it anew with `active-recon train-policy`, or choose another policy')
    try:
        with torch.device('meta'):
            scorer = ViewScorer.from_config(ScorerConfig.from_dict(json.loads(facts['config'])))
        scorer.load_state_dict(tensors, assign=True)
    except (KeyError, ValueError, TypeError, RuntimeError, ConfigError) as error:
        raise WeightsError(f'{path}: its tensors do not fit its config: {error}') from error
    scorer.requires_grad_(False)
    return scorer.eval()
