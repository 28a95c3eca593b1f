"""Training checkpoints: safetensors for the numbers, JSON for the rest; never pickle."""

from collections.abc import Iterator
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from active_recon.config import with_current_keys
from active_recon.errors import ConfigError, DataError
from active_recon.json_text import json_value
from active_recon.models.weights_bytes import misfit
from active_recon.whole_files import whole_file
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import nn, Tensor
from torch.optim import Optimizer

_FREE = {'bfloat16', 'checkpoint_every', 'validate_every'}  # settings of a training


@dataclass(frozen=True)
class Checkpoint:
    """The progress of a training: steps done, settings, and what was measured."""

    step: int
    settings: dict[str, Any]
    log: list[dict[str, float]]


def save_checkpoint(path: Path, module: nn.Module, optimizer: Optimizer,
                    checkpoint: Checkpoint) -> None:
    """Write a checkpoint atomically: if writing is interrupted, the previous one is kept."""
    # Cloned: safetensors refuses tensors that share memory, as tied weights do
    tensors = {f'module.{name}': tensor.detach().contiguous().clone()
               for name, tensor in module.state_dict().items()}
    for name, parameter in module.named_parameters():
        for key, value in optimizer.state[parameter].items():
            tensors[f'optimizer.{key}.{name}'] = value
    meta = json.dumps({'step': checkpoint.step, 'settings': checkpoint.settings,
                       'log': checkpoint.log})
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as unfinished:
        # Written here, since safetensors would keep others of the user's group from reading it
        unfinished.write_bytes(save(tensors, {'checkpoint': meta}))


def load_checkpoint(path: Path, module: nn.Module, optimizer: Optimizer) -> Checkpoint:
    """Restore a module and its optimizer; raises DataError on an incomplete checkpoint."""
    from safetensors import safe_open

    try:
        with safe_open(path, framework='pt') as stored:
            meta = json_value(stored.metadata()['checkpoint'])
        tensors: dict[str, Tensor] = load_file(path)
        module.load_state_dict({name.removeprefix('module.'): tensor
                                for name, tensor in tensors.items()
                                if name.startswith('module.')})
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise DataError(f'{path}: no whole checkpoint of this model: {misfit(error)}') from error
    for name, parameter in module.named_parameters():
        for key in ('step', 'exp_avg', 'exp_avg_sq'):
            stored_name = f'optimizer.{key}.{name}'
            if stored_name in tensors:
                # AdamW counts its steps on the CPU, wherever the parameter lies
                device = 'cpu' if key == 'step' else parameter.device
                optimizer.state[parameter][key] = tensors[stored_name].to(device)
    return Checkpoint(meta['step'], with_current_keys(meta['settings']), meta['log'])


def step_reached(path: Path) -> int:
    """Return the steps that a checkpoint has behind it, 0 where there is no whole one."""
    from safetensors import safe_open

    try:
        with safe_open(path, framework='np') as stored:
            return int(json_value(stored.metadata()['checkpoint'])['step'])
    except (OSError, SafetensorError, KeyError, TypeError, ValueError):
        return 0


def resume_checkpoint(path: Path, module: nn.Module, optimizer: Optimizer,
                      settings: dict[str, Any]) -> Checkpoint:
    """
    Restore as `load_checkpoint`; raises ConfigError if it was made under other settings.

    What an older checkpoint does not tell, such as the data, is taken to be the same.
    """
    stored = load_checkpoint(path, module, optimizer)
    asked = {name: settings.get(name) for name in stored.settings}
    if differing := '; '.join(differences(stored.settings, asked)):
        raise ConfigError(f'{path}: made under other settings: {differing}; ask for the same, or '
                          'name another folder with --out')
    return stored


def differences(made: dict[str, Any], asked: dict[str, Any]) -> Iterator[str]:
    """
    Yield in words how settings differ, those within settings each by itself.

    Those of _FREE may: they change no result but for mixed precision, which is what suits the
    machine, and another may go on with what one began.
    """
    for name in sorted(made.keys() | asked.keys()):
        one, other = made.get(name), asked.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            yield from differences(one, other)
        elif one != other and name not in _FREE:
            yield f'{name}: expected {_short(one)} as before, got {_short(other)}'


def _short(value: Any) -> str:
    """Return a setting as text; of a SHA-256 its begin tells enough."""
    return repr(value[:12]) if isinstance(value, str) else repr(value)
