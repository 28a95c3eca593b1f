"""Networks that were exported as graphs, in the place of torch's where nothing is learned."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.weights import Bundle
from active_recon.runtimes import AUTO, load_runtime
from active_recon.runtimes.exported import ExportedRuntime
from active_recon.runtimes.graph_files import is_exported
from active_recon.runtimes.precision import has_bf16
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_SURE = 1e-7  # logits of float32 probabilities are finite up to here


class ExportedNetwork(ReconstructionNetwork):
    """
    A network in graphs of one object each, run row by row; it has no parameters.

    What tells it from others is a buffer: the hash of its weights, and what runs it. `opened`
    opens the graphs, once more where the network is sent to another process.
    """

    def __init__(self, runtime: ExportedRuntime, opened: 'Callable[[], ExportedNetwork]') -> None:
        super().__init__()
        self._runtime, self._opened = runtime, opened
        spec = runtime.spec
        self.image_size, self.resolution = spec.image_size, spec.resolution
        self.needs_front = spec.needs_front
        told = ' '.join(runtime.provenance[name] for name in ('weights_sha256', 'computed_by'))
        self.register_buffer('provenance', torch.tensor(list(told.encode()), dtype=torch.uint8))

    def __reduce__(self) -> 'tuple[Callable[[], ExportedNetwork], tuple[()]]':
        """Return what opens the network anew: graphs cannot be sent."""
        return self._opened, ()

    def initial_state(self, batch: int) -> State:
        """Return the state before any view of so many objects."""
        return {name: torch.from_numpy(part).expand(batch, *part.shape[1:])
                for name, part in self._runtime.initial_state().items()}

    def encode(self, images: Tensor, cameras: Cameras) -> Tensor:
        """Return the encoding of each image, (B, ...)."""
        return torch.from_numpy(np.concatenate([
            self._runtime.encode(image, seen_from) for image, seen_from in zip(
                _rows(images), _seen_from(cameras), strict=True)]))

    def update(self, encoded: Tensor, cameras: Cameras, state: State) -> State:
        """Return the state updated by one encoded image of each object, (B, ...)."""
        found: dict[str, NDArray[np.float32]] = {}
        for row, (one, seen_from) in enumerate(zip(_rows(encoded), _seen_from(cameras),
                                                   strict=True)):
            known = {name: part[row:row + 1].numpy() for name, part in state.items()}
            for name, array in self._runtime.update(one, seen_from, known).items():
                every = found.setdefault(
                    name, np.empty((len(encoded), *array.shape[1:]), np.float32))
                every[row] = array[0]
        return {name: torch.from_numpy(array) for name, array in found.items()}

    def decode(self, state: State) -> Tensor:
        """Return the occupancy's logits of a state after a view, (B, R, R, R)."""
        parts = [self._runtime.decode({name: part[row:row + 1].numpy()
                                       for name, part in state.items()})
                 for row in range(len(state['latent']))]
        return torch.from_numpy(np.concatenate(parts)).logit(eps=_SURE)


def network_in(runtime: str, weights: Path, bundle: Bundle, bfloat16: bool,
               threads: int) -> ReconstructionNetwork:
    """
    Return the network of weights in a runtime, one of `RUNTIME_CHOICES`.

    In torch it is that of the bundle, read from the same file. `bfloat16`: elsewhere in half
    precision where the processor has it. Raises WeightsError where it was not exported, and
    ConfigError where the runtime is not available.
    """
    if runtime == 'torch' or runtime == AUTO and not is_exported(weights):
        return bundle.reconstruction
    half = bfloat16 and has_bf16() and runtime != 'onnxruntime'
    found = _exported(weights, runtime, threads, 'bf16' if half else 'f32')
    return bundle.reconstruction if found is None else found


def _exported(weights: Path, runtime: str, threads: int, precision: str) -> Any:
    """Return the network of exported weights; None where the runtime that was chosen is torch."""
    loaded = load_runtime(weights, runtime, threads=threads, precision=precision)
    return ExportedNetwork(loaded, partial(
        _exported, weights, runtime, threads, precision)) if isinstance(
            loaded, ExportedRuntime) else None


def _rows(values: Tensor) -> Iterator[NDArray[np.float32]]:
    array = values.numpy()
    return (array[row:row + 1] for row in range(len(array)))


def _seen_from(cameras: Cameras) -> Iterator[dict[str, NDArray[np.float32]]]:
    for pose, lens in zip(_rows(cameras.poses), _rows(cameras.intrinsics), strict=True):
        yield {'pose': pose, 'intrinsics': lens}
