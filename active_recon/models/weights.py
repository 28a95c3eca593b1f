"""Weights on disk: safetensors, with a card in JSON beside them; never pickle."""

from contextlib import nullcontext
from dataclasses import dataclass, field
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.config import Config
from active_recon.errors import ConfigError, WeightsError
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.registry import network_entry, NETWORKS
from active_recon.models.weights_bytes import (
    in_precision,
    misfit,
    require_finite,
    weights_bytes,
)
from active_recon.models.weights_files import PAPER_MODEL, read_metadata, SHIPPED, weights_hash
from active_recon.whole_files import whole_file
from safetensors import safe_open, SafetensorError
import torch
from torch import nn


@dataclass(frozen=True, eq=False)
class Bundle:
    """A network, its view policy's model if it has one, sizes, threshold, and the card's rest."""

    reconstruction: ReconstructionNetwork
    attention: nn.Module | None
    config: Config
    threshold: float
    card: dict[str, Any] = field(default_factory=dict)
    model: str = PAPER_MODEL


def save_weights(path: Path, bundle: Bundle) -> None:
    """
    Write `path` (.safetensors) and the card beside it (.json).

    Floats are stored in half precision, but for tensors with numbers too large for it. Both appear
    whole, the card first.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {f'{part}.{name}': in_precision(torch.float16, tensor.detach().cpu()).contiguous()
               for part, module in _parts(bundle).items()
               for name, tensor in module.state_dict().items()}
    config = json.dumps(bundle.config.to_dict())
    # Written here: safetensors itself writes for the owner alone
    with whole_file(path) as unfinished, whole_file(path.with_suffix('.json')) as card:
        unfinished.write_bytes(weights_bytes(tensors, {
            'model': bundle.model, 'config': config, 'threshold': repr(bundle.threshold)}))
        card.write_text(json.dumps({
            'model': bundle.model, 'config': bundle.config.to_dict(),
            'threshold': bundle.threshold,
            'sha256': weights_hash(unfinished), **bundle.card}, indent=2) + '\n')


def load_weights(path: Path | None = None, device: str = 'cpu') -> Bundle:
    """
    Read weights and build their networks, in evaluation mode, in float32.

    None reads the weights that ship. Raises WeightsError where the file is missing, truncated, of
    a model that is not in the registry, or has parameters that are not finite.
    """
    path = path or SHIPPED
    metadata = read_metadata(path)
    try:
        with safe_open(path, framework='pt', device=device) as stored:
            tensors = {name: stored.get_tensor(name) for name in stored.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{path}: no whole safetensors file: {error}') from error
    try:
        entry = network_entry(metadata.model)
        config = entry.config.from_dict(metadata.config)
        # Built on no device: the fresh weights would only be overwritten, and drawing takes time.
        # Networks of others may have tensors that are not stored
        with torch.device('meta') if metadata.model in NETWORKS else nullcontext():
            attention = (entry.policy(config)
                         if entry.policy is not None and _has(tensors, 'attention') else None)
            bundle = Bundle(entry.build(config), attention, config, metadata.threshold,
                            model=metadata.model)
    except (KeyError, ValueError, TypeError, RuntimeError, ConfigError) as error:
        raise WeightsError(f'{path}: its config cannot be read: {error}') from error
    for part, module in _parts(bundle).items():
        own = {name.removeprefix(f'{part}.'): in_precision(torch.float32, tensor)
               for name, tensor in tensors.items() if name.startswith(f'{part}.')}
        try:
            module.load_state_dict(own, assign=True)
        except RuntimeError as error:
            raise WeightsError(f'{path}: its tensors do not fit its config: '
                               f'{misfit(error)}') from error
        require_finite(path, module, part)
        module.to(device).eval().requires_grad_(False)
    return bundle


def state_hash(module: nn.Module) -> str:
    """Return the SHA-256 of all that a module holds, parameters and buffers."""
    digest = hashlib.sha256()
    for name, tensor in sorted(module.state_dict().items()):
        digest.update(name.encode() + b'\0')
        digest.update(tensor.detach().cpu().contiguous().numpy().tobytes())
    return digest.hexdigest()


def _parts(bundle: Bundle) -> dict[str, nn.Module]:
    parts: dict[str, nn.Module] = {'reconstruction': bundle.reconstruction}
    return parts if bundle.attention is None else parts | {'attention': bundle.attention}


def _has(tensors: dict[str, torch.Tensor], part: str) -> bool:
    return any(name.startswith(f'{part}.') for name in tensors)
