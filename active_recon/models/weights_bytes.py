"""The bytes of a weights file: the same tensors and facts give the same bytes, and so one hash."""

from collections.abc import Mapping
import json
from pathlib import Path
from textwrap import shorten

from active_recon.errors import WeightsError
from safetensors.torch import save
import torch
from torch import nn, Tensor

_LENGTH = 8  # bytes that hold the header's length, little endian
_LINE = 300  # letters of a message, beside its file's path


def weights_bytes(tensors: Mapping[str, Tensor], facts: Mapping[str, str]) -> bytes:
    """
    Return a safetensors file with these facts as its metadata, in the order given.

    safetensors itself writes them in an order that is drawn in each process.
    """
    written = save(dict(tensors), dict(facts))
    end = _LENGTH + int.from_bytes(written[:_LENGTH], 'little')
    header = json.loads(written[_LENGTH:end])
    header['__metadata__'] = dict(facts)
    ordered = json.dumps(header, ensure_ascii=False, separators=(',', ':')).encode()
    ordered += b' ' * (-len(ordered) % _LENGTH)
    return len(ordered).to_bytes(_LENGTH, 'little') + ordered + written[end:]


def in_precision(dtype: torch.dtype, tensor: Tensor) -> Tensor:
    """Return a tensor in a precision; whole numbers, and what it would make infinite, stay."""
    if not tensor.is_floating_point():
        return tensor
    converted = tensor.to(dtype)
    if is_finite(converted) or torch.equal(converted.isfinite(), tensor.isfinite()):
        return converted
    return tensor


def is_finite(tensor: Tensor) -> bool:
    """Return whether all numbers of a tensor are finite, ten times as fast as `isfinite`."""
    return not tensor.numel() or all(each.isfinite() for each in tensor.detach().aminmax())


def misfit(error: Exception) -> str:
    """Return on one line why tensors make no module; torch has a line for each of them."""
    return shorten(str(error), _LINE, placeholder=' ...')


def require_finite(path: Path, module: nn.Module, part: str = '') -> None:
    """Raise WeightsError where a parameter of a module that was read is not finite."""
    for name, parameter in module.named_parameters(part):
        if not is_finite(parameter):
            raise WeightsError(f'{path}: not finite: expected finite numbers in {name}, got '
                               'others; a training may have diverged: take other weights')
