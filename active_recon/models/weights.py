"""Weights on disk: safetensors, with a card in JSON beside them; never pickle."""

from dataclasses import dataclass, field
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.config import NetworkConfig
from active_recon.errors import ConfigError, WeightsError
from active_recon.models.attention import AttentionModel
from active_recon.models.reconstruction import ReconstructionNetwork
from safetensors import safe_open, SafetensorError
from safetensors.torch import save_file
import torch
from torch import nn

MODEL = '2d3d-attention'
SHIPPED = Path(__file__).parents[1] / 'weights' / f'{MODEL}.safetensors'


@dataclass(frozen=True, eq=False)
class Bundle:
    """The two networks, their sizes, the validation threshold, and the card of the rest."""

    reconstruction: ReconstructionNetwork
    attention: AttentionModel
    config: NetworkConfig
    threshold: float
    card: dict[str, Any] = field(default_factory=dict)


def save_weights(path: Path, bundle: Bundle) -> None:
    """Write `path` (.safetensors, half precision) and the card beside it (.json)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {f'{part}.{name}': tensor.detach().cpu().half().contiguous()
               for part, module in _parts(bundle).items()
               for name, tensor in module.state_dict().items()}
    config = json.dumps(bundle.config.to_dict())
    save_file(tensors, path, {'model': MODEL, 'config': config,
                              'threshold': repr(bundle.threshold)})
    path.chmod(0o644)  # safetensors writes for the owner alone
    card = {'model': MODEL, 'config': bundle.config.to_dict(), 'threshold': bundle.threshold,
            'sha256': weights_hash(path), **bundle.card}
    path.with_suffix('.json').write_text(json.dumps(card, indent=2) + '\n')


def load_weights(path: Path | None = None, device: str = 'cpu') -> Bundle:
    """
    Read weights and build their networks, in evaluation mode, in float32.

    None reads the weights that ship. Raises WeightsError where the file is missing, truncated or
    of another model.
    """
    path = path or SHIPPED
    if not path.is_file():
        raise WeightsError(f'{path}: expected a weights file (.safetensors), but there is no '
                           'such file')
    try:
        with safe_open(path, framework='pt', device=device) as stored:
            metadata = stored.metadata() or {}
            tensors = {name: stored.get_tensor(name) for name in stored.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{path}: expected a whole safetensors file, got: {error}') from error
    if metadata.get('model') != MODEL:
        raise WeightsError(f'{path}: expected weights of the model {MODEL}, got '
                           f'{metadata.get("model", "a file that names no model")}')
    try:
        config = NetworkConfig.from_dict(json.loads(metadata['config']))
        threshold = float(metadata['threshold'])
        # Built on no device: the fresh weights would only be overwritten, and drawing takes time
        with torch.device('meta'):
            bundle = Bundle(ReconstructionNetwork.from_config(config),
                            AttentionModel.from_config(config), config, threshold)
    except (KeyError, ValueError, TypeError, ConfigError) as error:
        raise WeightsError(f'{path}: its config cannot be read: {error}') from error
    for part, module in _parts(bundle).items():
        own = {name.removeprefix(f'{part}.'): tensor.float()
               for name, tensor in tensors.items() if name.startswith(f'{part}.')}
        try:
            module.load_state_dict(own, assign=True)
        except RuntimeError as error:
            raise WeightsError(f'{path}: its tensors do not fit its config: {error}') from error
        module.eval().requires_grad_(False)
    return bundle


def weights_hash(path: Path | None = None) -> str:
    """Return the SHA-256 of a weights file; None is the one that ships."""
    return hashlib.sha256((path or SHIPPED).read_bytes()).hexdigest()


def _parts(bundle: Bundle) -> dict[str, nn.Module]:
    return {'reconstruction': bundle.reconstruction, 'attention': bundle.attention}
