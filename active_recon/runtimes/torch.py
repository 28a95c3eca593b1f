"""Networks in torch, on the device where their weights lie."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from active_recon.errors import ConfigError, WeightsError
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.geometry.canonical import network_image
from active_recon.models.depth_refiner import DepthRefiner
from active_recon.models.depth_weights import load_refiner
from active_recon.models.lifting_encoder import IMAGE_SIZE
from active_recon.models.network import Cameras, ReconstructionNetwork
from active_recon.models.registry import network_entry
from active_recon.models.scorer_weights import load_scorer
from active_recon.models.segmenter import Segmenter
from active_recon.models.segmenter_weights import read_segmenter
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import config_hash, read_metadata, SHIPPED, weights_hash
from active_recon.runtimes.base import State
from active_recon.runtimes.precision import require_f32
import numpy as np
from numpy.typing import NDArray
import torch
from torch import nn, Tensor


class TorchRuntime:
    """A reconstruction network in torch; see Runtime."""

    def __init__(self, network: ReconstructionNetwork, threshold: float = 0.5,
                 threads: int | None = None,
                 provenance: Mapping[str, str] | None = None) -> None:
        self._network = network.eval()
        self._threads = threads
        self.spec = network.spec
        self.threshold = threshold
        self.provenance: Mapping[str, str] = {
            **(provenance or {}), **_provenance(network.device, threads)}

    @torch.inference_mode()
    def initial_state(self) -> State:
        """Return the state before any view."""
        return _arrays(self._network.initial_state(1))

    @torch.inference_mode()
    def step(self, image: NDArray[np.uint8], camera: Camera,
             state: State) -> tuple[NDArray[np.float32], NDArray[np.float32], State]:
        """Take in an image; see Runtime."""
        device = self._network.device
        with _computing_with(self._threads):
            batch = torch.from_numpy(image).to(device).permute(2, 0, 1)[None].float() / 255
            logits, known = self._network(
                batch, Cameras.of([camera]).to(device), _tensors(state, device))
            after = _arrays(known)
            return logits[0].sigmoid().cpu().numpy(), after['latent'][0], after

    def warm_up(self) -> None:
        """Run once, so that the first view is as fast as the others."""
        camera = orbit_camera(0.0)
        blank = np.zeros((camera.intrinsics.height, camera.intrinsics.width, 3), np.uint8)
        self.step(*network_image(blank, camera, self.spec), self.initial_state())


class TorchPolicyRuntime:
    """The model of a learned view policy in torch; see PolicyRuntime."""

    def __init__(self, model: nn.Module, threads: int | None = None) -> None:
        self._model: Any = model.eval()
        self._threads = threads
        self._device = next(model.parameters()).device
        self.facts = cast(Mapping[str, Any], model.facts)
        self.provenance: Mapping[str, str] = _provenance(self._device, threads)

    @torch.inference_mode()
    def initial_state(self, batch: int) -> State:
        """Return the state before any view."""
        return _arrays(self._model.initial_state(batch))

    @torch.inference_mode()
    def step(self, inputs: Mapping[str, NDArray[np.float32]],
             state: State) -> tuple[Mapping[str, NDArray[np.float32]], State]:
        """Return the model's outputs after a view, and the next state."""
        with _computing_with(self._threads):
            outputs, known = self._model(
                **_tensors(inputs, self._device), state=_tensors(state, self._device))
            return _arrays(outputs._asdict()), _arrays(known)


class TorchDepthRuntime:
    """A depth refiner in torch; see DepthRuntime."""

    def __init__(self, refiner: DepthRefiner, threads: int | None = None) -> None:
        self._refiner, self._threads = refiner.eval(), threads
        self.provenance: Mapping[str, str] = _provenance(
            next(refiner.parameters()).device, threads)

    @torch.inference_mode()
    def refine(self, occupancy: NDArray[np.float32], evidence: NDArray[np.float32],
               state: State) -> NDArray[np.float32]:
        """Return the corrected occupancy; see DepthRuntime."""
        device = next(self._refiner.parameters()).device
        with _computing_with(self._threads):
            given = _tensors({'occupancy': occupancy[None], 'evidence': evidence[None],
                              'count': state['coarse_count'], 'total': state['coarse_sum']},
                             device)
            refined: NDArray[np.float32] = self._refiner.refine(**given)[0].cpu().numpy()
            return refined


class TorchSegmenterRuntime:
    """A segmenter in torch; see SegmenterRuntime."""

    def __init__(self, segmenter: Segmenter, threads: int | None = None) -> None:
        self._segmenter, self._threads = segmenter.eval(), threads
        self.image_size = IMAGE_SIZE
        self._device = next(segmenter.parameters()).device
        self.provenance: Mapping[str, str] = _provenance(self._device, threads)

    @torch.inference_mode()
    def segment(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return how likely each pixel is the object's; see SegmenterRuntime."""
        with _computing_with(self._threads):
            batch = torch.from_numpy(image).to(self._device).permute(2, 0, 1)[None].float() / 255
            found: NDArray[np.float32] = self._segmenter(batch)[0, 0].sigmoid().cpu().numpy()
            return found


def load_network(weights: Path | None, device: str, threads: int | None,
                 precision: str) -> TorchRuntime:
    """Return the network of a weights file; see `load_runtime`."""
    _require(device, precision)
    bundle = load_weights(weights, device)
    return TorchRuntime(bundle.reconstruction, bundle.threshold, threads, {
        'weights_sha256': weights_hash(weights), 'config_sha256': config_hash(bundle.config)})


def load_policy(weights: Path | None, device: str, threads: int | None,
                precision: str) -> TorchPolicyRuntime:
    """Return the policy in a weights file, or beside it; raises WeightsError without one."""
    _require(device, 'f32')  # whatever the network's
    if network_entry(read_metadata(weights or SHIPPED).model).policy is None:
        return TorchPolicyRuntime(load_scorer(weights, device), threads)
    model = load_weights(weights, device).attention
    if model is None:
        raise WeightsError(f'{(weights or SHIPPED).name}: no view policy in these weights: take '
                           'those of lifting or 2d3d-attention, or a policy that is not learned')
    return TorchPolicyRuntime(model, threads)


def load_depth(weights: Path | None, device: str, threads: int | None,
               precision: str) -> TorchDepthRuntime:
    """Return the depth refiner beside a weights file; raises WeightsError without one."""
    _require(device, 'f32')  # whatever the network's
    return TorchDepthRuntime(load_refiner(weights, device), threads)


def load_segmenter(weights: Path, device: str, threads: int | None,
                   precision: str) -> TorchSegmenterRuntime:
    """Return the segmenter in a file; see `load_segmenter_runtime`."""
    _require(device, 'f32')  # whatever the network's
    return TorchSegmenterRuntime(read_segmenter(weights, device), threads)


def _require(device: str, precision: str) -> None:
    require_f32(precision, 'torch')
    try:
        kind = torch.device(device).type
    except RuntimeError as error:
        raise ConfigError('parameter device: unknown value: expected one of torch, such as cpu or '
                          f'cuda, got {device!r}') from error
    if kind == 'cuda' and not torch.cuda.is_available():
        raise ConfigError(f'parameter device: {device} not available: expected a device that '
                          'torch can use, but this torch finds no GPU; use cpu')


def _provenance(device: torch.device, threads: int | None) -> dict[str, str]:
    count = torch.get_num_threads() if threads is None else threads
    return {'computed_by': f'torch {torch.__version__}, f32, {device.type}, {count} threads'}


def _tensors(arrays: State, device: torch.device) -> dict[str, Tensor]:
    # What was read from a message cannot be written to, which torch does not like
    return {name: torch.from_numpy(np.require(array, requirements=('C', 'W'))).to(device)
            for name, array in arrays.items()}


def _arrays(tensors: Mapping[str, Tensor]) -> dict[str, NDArray[np.float32]]:
    return {name: tensor.cpu().numpy() for name, tensor in tensors.items()}


@contextmanager
def _computing_with(threads: int | None) -> Iterator[None]:
    """
    Let torch compute with so many threads: sums that are shared out otherwise round otherwise.

    Nothing else has to be fixed. The networks' operations on a CPU all add in the same order
    every time, and torch's switch for deterministic algorithms takes seconds to import.
    """
    before = torch.get_num_threads()
    if threads is None or threads == before:
        yield
        return
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)
