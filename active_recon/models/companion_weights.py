"""Weights that belong beside a network's: a file of their own, for one network only."""

from collections.abc import Callable
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any, Generic, TypeVar

from active_recon.config import Config
from active_recon.errors import ConfigError, WeightsError
from active_recon.json_text import json_value
from active_recon.models.weights_bytes import (
    in_precision,
    misfit,
    require_finite,
    weights_bytes,
)
from active_recon.models.weights_files import weights_hash
from active_recon.whole_files import whole_file
from safetensors import safe_open, SafetensorError
import torch
from torch import nn

Module = TypeVar('Module', bound=nn.Module)


@dataclass(frozen=True)
class Companion(Generic[Module]):
    """
    A module that was trained for the weights of one network, or serves every network.

    - kind: what its files call themselves
    - build: makes it of its config's mapping, with fresh weights
    - half: whether its weights are stored in half precision; they are read as float32
    - no_such, of_others: what is said of a file that is of another kind, and of one that was
      trained for other weights; advice: what to do about the latter
    """

    kind: str
    build: Callable[[dict[str, Any]], Module]
    no_such: str
    of_others: str
    advice: str
    half: bool = False

    def save(self, path: Path, module: Module, config: Config, network_sha256: str | None,
             card: dict[str, Any]) -> None:
        """
        Write `path` (.safetensors) for a network's weights, or any, and the card beside it.

        Both appear whole, the card first.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        belongs_to = {} if network_sha256 is None else {'network_sha256': network_sha256}
        dtype = torch.float16 if self.half else torch.float32
        tensors = {name: in_precision(dtype, tensor.detach().cpu()).contiguous()
                   for name, tensor in module.state_dict().items()}
        with whole_file(path) as unfinished, whole_file(path.with_suffix('.json')) as told:
            unfinished.write_bytes(weights_bytes(tensors, {
                'model': self.kind, 'config': json.dumps(config.to_dict()), **belongs_to}))
            told.write_text(json.dumps({
                'model': self.kind, 'config': config.to_dict(), **belongs_to,
                'sha256': weights_hash(unfinished), **card}, indent=2) + '\n')

    def is_kind(self, path: Path) -> bool:
        """Return whether a file calls itself one of this kind; False where it cannot be read."""
        try:
            with safe_open(path, framework='pt') as stored:
                return (stored.metadata() or {}).get('model') == self.kind
        except (SafetensorError, OSError):
            return False

    def read(self, path: Path, network_sha256: str | None, device: str = 'cpu') -> Module:
        """
        Return the module in a file, for the network whose weights have a hash; it is not trained.

        Without a hash it may be for any network, as where it is only trained further.

        Raises WeightsError where the file is not whole or of another kind, where it was trained
        for other weights, and where it has parameters that are not finite.
        """
        try:
            with safe_open(path, framework='pt', device=device) as stored:
                facts = stored.metadata() or {}
                tensors = {name: in_precision(torch.float32, stored.get_tensor(name))
                           for name in stored.keys()}  # noqa: SIM118
        except (SafetensorError, OSError) as error:
            raise WeightsError(f'{path}: no whole safetensors file: {error}') from error
        if facts.get('model') != self.kind:
            raise WeightsError(f'{path}: {self.no_such}, got {facts.get("model")!r}')
        if network_sha256 is not None and facts.get('network_sha256') != network_sha256:
            raise WeightsError(
                f'{path}: {self.of_others}: expected one trained for {network_sha256[:12]}, got '
                f'one for {facts.get("network_sha256", "none")[:12]}; {self.advice}')
        try:
            with torch.device('meta'):
                module = self.build(json_value(facts['config']))
            module.load_state_dict(tensors, assign=True)
        except (KeyError, ValueError, TypeError, RuntimeError, ConfigError) as error:
            raise WeightsError(f'{path}: its tensors do not fit its config: '
                               f'{misfit(error)}') from error
        require_finite(path, module)
        module.requires_grad_(False)
        return module.eval()
