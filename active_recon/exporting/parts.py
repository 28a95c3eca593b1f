"""The parts of a network and of a policy's model as modules from tensors to tensors."""

from collections.abc import Mapping, Sequence
import copy
from dataclasses import dataclass
from typing import TypeVar

from active_recon.models.depth_refiner import DepthRefiner, KINDS
from active_recon.models.lifting import COARSE_SIDE
from active_recon.models.lifting_encoder import IMAGE_SIZE, Norm
from active_recon.models.network import Cameras, ReconstructionNetwork, State
from active_recon.models.segmenter import Segmenter
from active_recon.runtimes.graph_files import NEXT
from active_recon.volumes.voxels import FINE_RESOLUTION
import torch
from torch import nn, Tensor

Network = TypeVar('Network', bound=nn.Module)


@dataclass(frozen=True, eq=False)
class Part:
    """
    A module that takes and gives tensors by their places, and their names.

    `dynamic` names the axes of inputs and outputs that may have any length.
    """

    module: nn.Module
    inputs: Mapping[str, Tensor]
    outputs: Sequence[str]
    dynamic: Mapping[str, Mapping[int, str]]


class ChannelNorm(nn.GroupNorm):
    """
    Group normalisation as a shift and a scale of each channel, of one object.

    What torch exports splits the channels in groups, for which runtimes change the order of all
    numbers in memory, twice; this does not. Mean and variance are taken one after the other,
    which half precision needs.
    """

    def forward(self, cells: Tensor) -> Tensor:
        """Return cells (1, C, ...) normalised."""
        axes = list(range(2, cells.ndim))
        if not axes:
            return super().forward(cells)
        group = self.num_channels // self.num_groups
        same = torch.kron(torch.eye(self.num_groups), torch.full((group, group), 1 / group))
        spread = (1, self.num_channels, *(1 for _ in axes))
        apart = cells - (cells.mean(dim=axes) @ same).reshape(spread)
        length = torch.linalg.vector_norm(apart, dim=axes)
        variance = (length * length * (1 / cells[0, 0].numel())) @ same
        scale = self.weight * (variance + self.eps).rsqrt()
        found: Tensor = apart * scale.reshape(spread) + self.bias.reshape(spread)
        return found


class _Encode(nn.Module):
    def __init__(self, network: ReconstructionNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, image: Tensor, pose: Tensor, intrinsics: Tensor) -> Tensor:
        return self.network.encode(image, Cameras(pose, intrinsics))


class _Update(nn.Module):
    def __init__(self, network: ReconstructionNetwork, names: Sequence[str]) -> None:
        super().__init__()
        self.network, self.names = network, names

    def forward(self, encoded: Tensor, pose: Tensor, intrinsics: Tensor,
                *known: Tensor) -> tuple[Tensor, ...]:
        state = self.network.update(
            encoded, Cameras(pose, intrinsics), dict(zip(self.names, known, strict=True)))
        return tuple(state[name] for name in self.names)


class _Decode(nn.Module):
    def __init__(self, network: ReconstructionNetwork, names: Sequence[str]) -> None:
        super().__init__()
        self.network, self.names = network, names

    def forward(self, *known: Tensor) -> Tensor:
        return self.network.decode(dict(zip(self.names, known, strict=True))).sigmoid()


class _Refine(nn.Module):
    def __init__(self, refiner: DepthRefiner) -> None:
        super().__init__()
        self.refiner = refiner

    def forward(self, occupancy: Tensor, evidence: Tensor, count: Tensor,
                total: Tensor) -> Tensor:
        return self.refiner.refine(occupancy, evidence, count, total)


class _Segment(nn.Module):
    def __init__(self, segmenter: Segmenter) -> None:
        super().__init__()
        self.segmenter = segmenter

    def forward(self, image: Tensor) -> Tensor:
        found: Tensor = self.segmenter(image).sigmoid()
        return found


class _Choose(nn.Module):
    def __init__(self, model: nn.Module, inputs: Sequence[str], names: Sequence[str]) -> None:
        super().__init__()
        self.model, self.inputs, self.names = model, inputs, names

    def forward(self, *given: Tensor) -> tuple[Tensor, ...]:
        count = len(self.inputs)
        found, state = self.model(
            **dict(zip(self.inputs, given[:count], strict=True)),
            state=dict(zip(self.names, given[count:], strict=True)))
        return (*found, *(state[name] for name in self.names))


@torch.no_grad()
def network_parts(network: ReconstructionNetwork) -> dict[str, Part]:
    """Return `encode`, `update` and `decode` of a network, for one object."""
    network = _for_graphs(network)
    state = network.initial_state(1)
    camera = {'pose': torch.eye(4)[None], 'intrinsics': torch.eye(3)[None]}
    camera['pose'][:, 2, 3] = -2.1
    camera['intrinsics'][:, :2] *= network.image_size
    channels = 3 if network.needs_front else 4
    image = torch.full((1, channels, network.image_size, network.image_size), 0.5)
    encode = _Encode(network)
    encoded = encode(image, **camera)
    after = network.update(encoded, Cameras(*camera.values()), state)
    return {
        'encode': Part(encode, {'image': image, **camera}, ['encoded'], {}),
        'update': Part(_Update(network, list(state)), {'encoded': encoded, **camera, **state},
                       [NEXT + name for name in state], {}),
        'decode': Part(_Decode(network, list(after)), after, ['occupancy'], {})}


@torch.no_grad()
def policy_part(model: nn.Module, inputs: Mapping[str, Tensor],
                axes: Mapping[str, Mapping[int, str]]) -> Part:
    """
    Return a policy's model, for any number of episodes.

    Takes inputs for two episodes, and the axes of them, besides the first, that vary.
    """
    model = copy.deepcopy(model).eval()
    state: State = model.initial_state(2)  # type: ignore[operator]
    found, _ = model(**inputs, state=state)
    outputs = [*found._fields, *(NEXT + name for name in state)]
    dynamic = {name: {0: 'episodes', **axes.get(name, {})} for name in (
        *inputs, *state, *outputs)}
    return Part(_Choose(model, list(inputs), list(state)), {**inputs, **state}, outputs, dynamic)


@torch.no_grad()
def depth_part(refiner: DepthRefiner) -> Part:
    """Return a depth refiner, for one object."""
    module = _Refine(refiner)
    fine, coarse = (FINE_RESOLUTION,) * 3, (COARSE_SIDE,) * 3
    inputs = {'occupancy': torch.full((1, *fine), 0.5), 'evidence': torch.zeros(1, KINDS, *fine),
              'count': torch.ones(1, 1, *coarse),
              'total': torch.zeros(1, refiner.features, *coarse)}
    return Part(_for_graphs(module), inputs, ['refined'], {})


@torch.no_grad()
def segment_part(segmenter: Segmenter) -> Part:
    """Return a segmenter, for one image with its mask of seen pixels."""
    image = torch.full((1, 4, IMAGE_SIZE, IMAGE_SIZE), 0.5)
    return Part(_for_graphs(_Segment(segmenter)), {'image': image}, ['object'], {})


def _for_graphs(network: Network) -> Network:
    """Return a copy of a module on the CPU whose normalisations are `ChannelNorm`."""
    copied = copy.deepcopy(network).eval().cpu()
    for layer in copied.modules():
        # Others that derive from it may normalise otherwise
        if type(layer) in (nn.GroupNorm, Norm) and layer.affine:
            layer.__class__ = ChannelNorm
    return copied
