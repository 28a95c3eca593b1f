"""One object as a frozen network comes to know it, view by view, beside its truth."""

from dataclasses import dataclass
import math

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import Observer
from active_recon.models.network import ReconstructionNetwork, State
from active_recon.policies import Observation
from active_recon.volumes.voxels import iou, PUBLISHED_FLOOR
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor
from torch.nn import functional

_ROWS = 6  # candidates that go through the network at once


@dataclass(frozen=True, eq=False)
class Walk:
    """The views taken, in order, and the network's state after them."""

    taken: tuple[int, ...]
    state: State


@dataclass(frozen=True, eq=False)
class Ahead:
    """
    What each of V views would bring after a walk, (V,) each, NaN for those taken.

    `iou` with the truth, which no robot knows; `expected`: the IoU that the network expects, which
    a robot would know once it had taken the view.
    """

    iou: NDArray[np.float64]
    expected: NDArray[np.float64]


class WatchedObject:
    """
    One rendering of an object, as a frozen network sees it; what was measured once is kept.

    Takes a set of one object and its truth (S, S, S) bool; where the network has more cells a
    side, the largest of those that make one counts.
    """

    def __init__(self, network: ReconstructionNetwork, views: ViewSet, truth: Tensor,
                 threshold: float, bfloat16: bool = False) -> None:
        self.views = views
        self._observer = Observer(network, views, bfloat16)
        self._truth, self._threshold = truth, threshold
        self._block = network.resolution // len(truth)
        self._iou: dict[tuple[int, ...], float] = {}
        self._ahead: dict[tuple[int, ...], Ahead] = {}

    @property
    def count(self) -> int:
        """V, the number of views there are."""
        return int(self.views.images.shape[1])

    @torch.inference_mode()
    def begin(self, view: int) -> Walk:
        """Return a walk of one view."""
        return self.step(Walk((), self._observer.initial_state(1)), view)

    @torch.inference_mode()
    def step(self, walk: Walk, view: int) -> Walk:
        """Return the walk with one more view."""
        return Walk((*walk.taken, view), self._observer.update(
            torch.zeros(1, dtype=torch.long), torch.tensor([view]), walk.state))

    @torch.inference_mode()
    def iou(self, walk: Walk) -> float:
        """Return the IoU after a walk."""
        if walk.taken not in self._iou:
            self._iou[walk.taken] = float(self._measured(walk.state)[0])
        return self._iou[walk.taken]

    @torch.inference_mode()
    def ahead(self, walk: Walk) -> Ahead:
        """Look at every view that was not taken yet."""
        if walk.taken in self._ahead:
            return self._ahead[walk.taken]
        fresh = [view for view in range(self.count) if view not in walk.taken]
        found = np.full((2, self.count), np.nan)
        for low in range(0, len(fresh), _ROWS):
            numbers = fresh[low:low + _ROWS]
            chosen = torch.tensor(numbers)
            state = {name: part.expand(len(chosen), *part.shape[1:])
                     for name, part in walk.state.items()}
            after = self._observer.update(torch.zeros_like(chosen), chosen, state)
            found[:, numbers] = torch.stack(self._measured(after)).double().numpy()
        self._ahead[walk.taken] = Ahead(*found)
        self._iou |= {(*walk.taken, view): float(found[0, view]) for view in fresh}
        return self._ahead[walk.taken]

    @torch.inference_mode()
    def observation(self, walk: Walk, wants_volume: bool) -> Observation:
        """Return what a policy sees after a walk: all views are its candidates."""
        poses, volume = self.views.poses.numpy(), None
        if wants_volume:
            occupancy = self._observer.occupancy(walk.state).cpu().numpy()
            volume = np.where(occupancy > PUBLISHED_FLOOR, occupancy, np.float32(0))
        latent = walk.state['latent'].float().cpu().numpy()
        return Observation(latent, poses[:, list(walk.taken)], poses, volume)

    def _measured(self, state: State) -> tuple[Tensor, Tensor]:
        """Return the IoU of states (B, ...), and that which the network expects, (B,) each."""
        logits = functional.max_pool3d(self._observer.decode(state)[:, None], self._block)[:, 0]
        kept = logits > math.log(self._threshold / (1 - self._threshold))
        occupancy = logits.sigmoid()
        inside = (occupancy * kept).sum((1, 2, 3))
        union = kept.float().sum((1, 2, 3)) + occupancy.sum((1, 2, 3)) - inside
        return iou(kept.cpu(), self._truth), (inside / union.clamp(min=1e-9)).cpu()
