"""Episodes in batches: a frozen network, a view policy, and what was known after every view."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

from active_recon.cameras import azimuth_difference
from active_recon.datasets.views import ViewSet
from active_recon.models.network import Folded, ReconstructionNetwork
from active_recon.policies.base import Policy
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Step:
    """B episodes after one more view: occupancy (B, X, Y, Z), A_t, and the azimuths taken."""

    occupancy: Tensor
    latent: Tensor
    taken: NDArray[np.float64]


@torch.inference_mode()
def roll_out(network: ReconstructionNetwork, policy: Policy, views: ViewSet, objects: Tensor,
             starts: Tensor, count: int, stand_ins: Tensor | None = None,
             bfloat16: bool = False) -> Iterator[Step]:
    """
    Run one episode for each object (B,) from the view it starts at (B,), yielding every view.

    The policy's azimuth is shown by the nearest rendered view, as on the turntable. `stand_ins`,
    (B,), are objects whose latents, seen from the same azimuths, the policy is given instead of
    the true ones: what a policy loses by it is what it owes to seeing.
    """
    azimuths = views.azimuths.numpy()
    chosen, hidden, other_hidden, state = starts, None, None, None
    taken = np.empty((len(objects), 0))
    for _ in range(count):
        at = azimuths[objects.numpy(), chosen.numpy()].astype(np.float64)
        taken = np.column_stack([taken, at])
        folded, hidden = fold_views(network, views, objects, chosen, hidden, bfloat16)
        latent = folded.latent
        yield Step(logits_of(network, folded, bfloat16).sigmoid(), latent, taken)
        if taken.shape[1] == count:
            return
        if stand_ins is not None:
            alike = nearest_views(azimuths[stand_ins.numpy()], at)
            other, other_hidden = fold_views(
                network, views, stand_ins, alike, other_hidden, bfloat16)
            latent = other.latent
        choice, state = policy.choose(latent.cpu().numpy(), taken, state)
        chosen = nearest_views(azimuths[objects.numpy()], choice.azimuth)


def fold_views(network: ReconstructionNetwork, views: ViewSet, objects: Tensor, chosen: Tensor,
               hidden: Any = None, bfloat16: bool = False,
               yaws: Tensor | float = 0.0) -> tuple[Folded, Any]:
    """
    Fold in views (B,) of objects (B,), on white; the latent comes in float32.

    `yaws`, radians, are added to the azimuths that the network is told: its error about the front.
    """
    device = device_of(network)
    images = views.white(objects, chosen).to(device, memory_format=torch.channels_last)
    azimuths = (views.azimuths[objects, chosen] + yaws).to(device)
    with torch.autocast(device.type, torch.bfloat16, enabled=bfloat16):
        folded, hidden = network.fold(images, azimuths, hidden)
    return Folded(folded.latent.float(), folded.features), hidden


def logits_of(network: ReconstructionNetwork, folded: Folded, bfloat16: bool = False) -> Tensor:
    """Decode what was folded in: occupancy logits (B, R, R, R), float32."""
    features = folded.features
    if features.ndim == 5:  # 3D convolutions take two thirds of the time if channels come last
        features = features.contiguous(memory_format=torch.channels_last_3d)
    with torch.autocast(features.device.type, torch.bfloat16, enabled=bfloat16):
        return network.decode(features).float()


def batches(count: int, size: int) -> Iterator[Tensor]:
    """Yield the indices of `count` rows, `size` at a time."""
    for low in range(0, count, size):
        yield torch.arange(low, min(low + size, count))


def nearest_views(azimuths: NDArray[np.float32], wanted: NDArray[np.float64]) -> Tensor:
    """Return the index of the view nearest to each azimuth wanted, (B, V) and (B,) to (B,)."""
    away = np.abs(azimuth_difference(azimuths, wanted[:, None]))
    return torch.from_numpy(away.argmin(axis=1))


def device_of(network: ReconstructionNetwork) -> torch.device:
    """Return where a network lies; one that is fitted, not trained, has buffers alone."""
    held = next(chain(network.parameters(), network.buffers()), None)
    return torch.device('cpu') if held is None else held.device
