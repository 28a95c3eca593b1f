"""Weights on disk: safetensors, with a card in JSON beside them; never pickle."""

from dataclasses import dataclass, field
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.config import Config, NetworkConfig
from active_recon.errors import ConfigError, WeightsError
from active_recon.models.attention import AttentionModel
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.registry import DEFAULT_MODEL, network_entry
from safetensors import safe_open, SafetensorError
from safetensors.torch import save_file
import torch
from torch import nn

FOLDER = Path(__file__).parents[1] / 'weights'
SHIPPED = FOLDER / f'{DEFAULT_MODEL}.safetensors'


@dataclass(frozen=True, eq=False)
class Bundle:
    """A network, its view policy's model if it has one, sizes, threshold, and the card's rest."""

    reconstruction: ReconstructionNetwork
    attention: AttentionModel | None
    config: Config
    threshold: float
    card: dict[str, Any] = field(default_factory=dict)
    model: str = DEFAULT_MODEL


def find_weights(model: str | Path | None = None) -> Path:
    """
    Return the weights file of a model's name, or of a path; None is the default's.

    Raises WeightsError where a name is meant whose weights do not ship.
    """
    if model is None:
        return SHIPPED
    path = Path(model)
    if path.suffix == '.safetensors' or len(path.parts) > 1:
        return path
    shipped = FOLDER / f'{model}.safetensors'
    if not shipped.is_file():
        names = ', '.join(sorted(file.stem for file in FOLDER.glob('*.safetensors')))
        raise WeightsError(f'expected a weights file (.safetensors) or a model whose weights '
                           f'ship ({names}), got {model}; `active-recon train` makes weights')
    return shipped


def save_weights(path: Path, bundle: Bundle) -> None:
    """Write `path` (.safetensors, half precision) and the card beside it (.json)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tensors = {f'{part}.{name}': tensor.detach().cpu().half().contiguous()
               for part, module in _parts(bundle).items()
               for name, tensor in module.state_dict().items()}
    config = json.dumps(bundle.config.to_dict())
    save_file(tensors, path, {'model': bundle.model, 'config': config,
                              'threshold': repr(bundle.threshold)})
    path.chmod(0o644)  # safetensors writes for the owner alone
    card = {'model': bundle.model, 'config': bundle.config.to_dict(),
            'threshold': bundle.threshold,
            'sha256': weights_hash(path), **bundle.card}
    path.with_suffix('.json').write_text(json.dumps(card, indent=2) + '\n')


def load_weights(path: Path | None = None, device: str = 'cpu') -> Bundle:
    """
    Read weights and build their networks, in evaluation mode, in float32.

    None reads the weights that ship. Raises WeightsError where the file is missing, truncated or
    of a model that is not in the registry.
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
    if 'model' not in metadata:
        raise WeightsError(f'{path}: expected weights of one of the networks, got a file that '
                           'names no model')
    model = metadata['model']
    try:
        entry = network_entry(model)
        config = entry.config.from_dict(json.loads(metadata['config']))
        threshold = float(metadata['threshold'])
        # Built on no device: the fresh weights would only be overwritten, and drawing takes time
        with torch.device('meta'):
            attention = (AttentionModel.from_config(config)
                         if isinstance(config, NetworkConfig) and _has(tensors, 'attention')
                         else None)
            bundle = Bundle(entry.build(config), attention, config, threshold, model=model)
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


def read_card(path: Path) -> dict[str, Any]:
    """Return the card beside weights; empty where there is none."""
    beside = path.with_suffix('.json')
    card: dict[str, Any] = json.loads(beside.read_text()) if beside.is_file() else {}
    return card


def weights_hash(path: Path | None = None) -> str:
    """Return the SHA-256 of a weights file; None is the one that ships."""
    return hashlib.sha256((path or SHIPPED).read_bytes()).hexdigest()


def config_hash(config: Config) -> str:
    """Return the SHA-256 of a network's sizes."""
    return hashlib.sha256(json.dumps(config.to_dict(), sort_keys=True).encode()).hexdigest()


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
