"""Episodes in batches: a frozen network, a view policy, and what was known after every view."""

from collections.abc import Iterator
from dataclasses import dataclass

from active_recon.cameras import azimuth_difference
from active_recon.datasets.views import ViewSet
from active_recon.models.reconstruction import ReconstructionNetwork
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
             starts: Tensor, count: int, stand_ins: Tensor | None = None) -> Iterator[Step]:
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
        seen, hidden = network(views.white(objects, chosen), hidden)
        yield Step(seen.logits.sigmoid(), seen.latent, taken)
        if taken.shape[1] == count:
            return
        latent = seen.latent
        if stand_ins is not None:
            alike = nearest_views(azimuths[stand_ins.numpy()], at)
            other, other_hidden = network(views.white(stand_ins, alike), other_hidden)
            latent = other.latent
        choice, state = policy.choose(latent.numpy(), taken, state)
        chosen = nearest_views(azimuths[objects.numpy()], choice.azimuth)


def nearest_views(azimuths: NDArray[np.float32], wanted: NDArray[np.float64]) -> Tensor:
    """Return the index of the view nearest to each azimuth wanted, (B, V) and (B,) to (B,)."""
    away = np.abs(azimuth_difference(azimuths, wanted[:, None]))
    return torch.from_numpy(away.argmin(axis=1))
