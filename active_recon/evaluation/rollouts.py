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
    observer = Observer(network, views, bfloat16)
    azimuths = views.azimuths.numpy()
    chosen, hidden, other_hidden, state = starts, None, None, None
    taken = np.empty((len(objects), 0))
    for _ in range(count):
        at = azimuths[objects.numpy(), chosen.numpy()].astype(np.float64)
        taken = np.column_stack([taken, at])
        folded, hidden = observer.fold(objects, chosen, hidden)
        latent = folded.latent
        yield Step(observer.decode(folded).sigmoid(), latent, taken)
        if taken.shape[1] == count:
            return
        if stand_ins is not None:
            alike = nearest_views(azimuths[stand_ins.numpy()], at)
            other, other_hidden = observer.fold(stand_ins, alike, other_hidden)
            latent = other.latent
        choice, state = policy.choose(latent.cpu().numpy(), taken, state)
        chosen = nearest_views(azimuths[objects.numpy()], choice.azimuth)


class Observer:
    """A frozen network that is shown views of a set, on white; it looks at each of them once."""

    def __init__(self, network: ReconstructionNetwork, views: ViewSet,
                 bfloat16: bool = False) -> None:
        self._network, self._views, self._bfloat16 = network, views, bfloat16
        self._device = device_of(network)
        self._rows: dict[tuple[int, int], int] = {}  # of `_seen`, by object and view
        self._seen: Tensor | None = None

    def fold(self, objects: Tensor, chosen: Tensor, hidden: Any = None,
             yaws: Tensor | float = 0.0) -> tuple[Folded, Any]:
        """
        Fold in views (B,) of objects (B,); the latent comes in float32.

        `yaws`, radians, are added to the azimuths that the network is told: its error about the
        front.
        """
        azimuths = (self._views.azimuths[objects, chosen] + yaws).to(self._device)
        with self._precision():
            folded, hidden = self._network.remember(
                self._look(objects, chosen), azimuths, hidden)
        return Folded(folded.latent.float(), folded.features), hidden

    def decode(self, folded: Folded) -> Tensor:
        """Return the occupancy's logits of what was folded in, (B, R, R, R) float32."""
        features = folded.features
        if features.ndim == 5:  # 3D convolutions take two thirds of the time if channels are last
            features = features.contiguous(memory_format=torch.channels_last_3d)
        with self._precision():
            return self._network.decode(features).float()

    def _look(self, objects: Tensor, chosen: Tensor) -> Tensor:
        wanted = list(zip(objects.tolist(), chosen.tolist(), strict=True))
        fresh = [each for each in dict.fromkeys(wanted) if each not in self._rows]
        if fresh:
            images = self._views.white(*torch.tensor(fresh).T).to(
                self._device, memory_format=torch.channels_last)
            seen = self._network.look(images)
            self._rows |= {each: row for row, each in enumerate(fresh, start=len(self._rows))}
            self._seen = seen if self._seen is None else torch.cat([self._seen, seen])
        assert self._seen is not None
        return self._seen[torch.tensor([self._rows[each] for each in wanted])]

    def _precision(self) -> torch.autocast:
        return torch.autocast(self._device.type, torch.bfloat16, enabled=self._bfloat16)


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
