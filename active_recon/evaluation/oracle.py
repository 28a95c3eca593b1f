"""The greedy oracle, which chooses views with the true shape: an upper reference for policies."""

from collections.abc import Iterator
from dataclasses import dataclass

from active_recon.datasets.views import ViewSet
from active_recon.environment import run_episode, TimeStep
from active_recon.evaluation.rollouts import batches, Observer, RenderedObjects, Seen, Step
from active_recon.models.network import ReconstructionNetwork, State
from active_recon.volumes.voxels import iou
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_ROWS = 240  # candidates in a batch of the network


def rows_of(state: State, rows: Tensor) -> State:
    """Return some rows of a state."""
    return {name: part[rows.to(part.device)] for name, part in state.items()}


@dataclass(frozen=True, eq=False)
class _Candidates:
    """The network's state, logits and IoU after each of B x K candidate views, in B x K rows."""

    views: Tensor
    state: State
    logits: Tensor
    iou: Tensor

    @property
    def best(self) -> Tensor:
        """Index of the candidate with the highest IoU, (B,) in [0, K); of equals the first."""
        return self.iou.argmax(dim=1)


@torch.inference_mode()
def _evaluated(observer: Observer, truth: Tensor, objects: Tensor, candidates: Tensor,
               state: State, threshold: float) -> _Candidates:
    """Evaluate candidate views (B, K) of objects (B,) with this truth, from a state of B rows."""
    batch, count = candidates.shape
    rows = torch.arange(batch).repeat_interleave(count)
    after = observer.update(objects[rows], candidates.flatten(), rows_of(state, rows))
    logits = observer.decode(after)
    truth = truth.to(logits.device)[:, None]
    occupied = logits.reshape(batch, count, *logits.shape[1:]).sigmoid() > threshold
    return _Candidates(candidates, after, logits, iou(occupied, truth).cpu())


class _LookaheadObjects(RenderedObjects):
    """Objects whose candidate views are all evaluated before one of them is taken."""

    def __init__(self, observer: Observer, objects: Tensor, starts: Tensor,
                 threshold: float) -> None:
        super().__init__(observer, objects)
        self._observer, self._threshold = observer, threshold
        self._starts = starts
        self.logits = torch.empty(0)

    def reset(self) -> None:
        """Begin an episode of each, with its first view as the only candidate."""
        super().reset()
        self.look_ahead(self._starts[:, None])

    def look_ahead(self, candidates: Tensor) -> Tensor:
        """Evaluate candidate views (B, K); return the best view of each object, (B,)."""
        self._ahead = _evaluated(self._observer, self._observer.views.voxels[self.objects],
                                 self.objects, candidates, self.seen.state, self._threshold)
        best: Tensor = candidates.gather(1, self._ahead.best[:, None])[:, 0]
        return best

    def step(self, view: Tensor) -> Seen:
        """Take one of the evaluated candidates of each object, (B,)."""
        batch, count = self._ahead.views.shape
        column = (self._ahead.views == view[:, None]).int().argmax(dim=1)
        rows = column + torch.arange(batch) * count
        self.logits = self._ahead.logits[rows.to(self._ahead.logits.device)]
        self.seen = Seen(rows_of(self._ahead.state, rows),
                         torch.column_stack([self.seen.chosen, view]))
        return self.seen


@torch.inference_mode()
def roll_out_oracle(network: ReconstructionNetwork, views: ViewSet, objects: Tensor,
                    starts: Tensor, count: int, threshold: float,
                    bfloat16: bool = False) -> Iterator[Step]:
    """
    Run B episodes as `roll_out` does, under the greedy oracle.

    It knows the truth: of the views not yet taken it chooses the one with the highest IoU after
    it.
    """
    own = _LookaheadObjects(Observer(network, views, bfloat16), objects, starts, threshold)
    every = torch.arange(views.images.shape[1]).expand(len(objects), -1)

    def choose(step: TimeStep[Tensor, Seen]) -> Tensor | None:
        taken = torch.zeros_like(every, dtype=torch.bool).scatter(1, step.known.chosen, True)
        fresh = every[~taken].reshape(len(objects), -1)
        return own.look_ahead(fresh) if fresh.shape[1] else None

    for step in run_episode(own, starts, choose, count):
        yield Step(own.logits.sigmoid(), step.known.state['latent'].float(),
                   own.azimuths(step.known))


def oracle_batch(views: ViewSet) -> int:
    """Return the number of episodes whose candidates form one batch of the network."""
    return max(1, _ROWS // views.images.shape[1])


@torch.inference_mode()
def sequence_iou(network: ReconstructionNetwork, views: ViewSet, item: int, threshold: float,
                 length: int = 3, bfloat16: bool = False) -> NDArray[np.float32]:
    """
    Return the IoU of one object after every ordered sequence of `length` views, (V, ..., V).

    Entry [i, j, k] is for view i, then j, then k, because a network may depend on the order. It is
    NaN where a view repeats. Sequences share the states of their prefixes: three of 24 views take
    12,720 passes.
    """
    count, observer = views.images.shape[1], Observer(network, views, bfloat16)
    table = np.full((count,) * length, np.nan, np.float32)
    if count < length:  # every sequence repeats a view
        return table

    def explore(sequences: Tensor, state: State) -> None:
        """Evaluate all views that can follow sequences (P, t), whose states are given."""
        taken = torch.zeros(len(sequences), count, dtype=torch.bool).scatter(1, sequences, True)
        fresh = torch.nonzero(~taken)[:, 1].reshape(len(sequences), -1)
        objects = torch.full((len(sequences),), item)
        seen = _evaluated(observer, views.voxels[objects], objects, fresh, state, threshold)
        longer = torch.cat([sequences.repeat_interleave(fresh.shape[1], dim=0),
                            fresh.reshape(-1, 1)], dim=1)
        if longer.shape[1] == length:
            table[tuple(longer.T.numpy())] = seen.iou.flatten().numpy()
            return
        at_once = max(1, _ROWS // (count - longer.shape[1]))
        for rows in batches(len(longer), at_once):
            explore(longer[rows], rows_of(seen.state, rows))

    explore(torch.empty(1, 0, dtype=torch.long), network.initial_state(1))
    return table
