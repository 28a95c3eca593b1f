"""What a policy could gain: views chosen by one who is told the truth."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.rollouts import batches, Observer, Step
from active_recon.models.network import Folded, ReconstructionNetwork
from active_recon.voxels import iou
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_ROWS = 240  # candidates that go through the network at once


def rows_of(state: Any, rows: Tensor) -> Any:
    """Return some rows of a hidden state: tensors, batch first, in (named) tuples and lists."""
    if isinstance(state, Tensor):
        return state[rows.to(state.device)]
    if isinstance(state, (tuple, list)):
        parts = [rows_of(part, rows) for part in state]
        return type(state)(*parts) if hasattr(state, '_fields') else type(state)(parts)
    return state  # a count of views, or nothing yet: the same for all


@dataclass(frozen=True, eq=False)
class _Candidates:
    """What the network would know after each of B x K candidate views; rows of B x K."""

    folded: Folded
    hidden: Any
    logits: Tensor
    iou: Tensor

    @property
    def best(self) -> Tensor:
        """The rows of the candidates of the highest IoU, (B,); the first of those alike."""
        batch, count = self.iou.shape
        return self.iou.argmax(dim=1) + torch.arange(batch) * count


@torch.inference_mode()
def _look_at(observer: Observer, truth: Tensor, objects: Tensor, candidates: Tensor, hidden: Any,
             threshold: float) -> _Candidates:
    """Look at candidates (B, K) of objects (B,) of this truth, after what is hidden, of B rows."""
    batch, count = candidates.shape
    rows = torch.arange(batch).repeat_interleave(count)
    folded, hidden = observer.fold(objects[rows], candidates.flatten(), rows_of(hidden, rows))
    logits = observer.decode(folded)
    truth = truth.to(logits.device)[:, None]
    occupied = logits.reshape(batch, count, *logits.shape[1:]).sigmoid() > threshold
    return _Candidates(folded, hidden, logits, iou(occupied, truth).cpu())


def roll_out_oracle(network: ReconstructionNetwork, views: ViewSet, objects: Tensor,
                    starts: Tensor, count: int, threshold: float,
                    bfloat16: bool = False) -> Iterator[Step]:
    """
    Run episodes (B,) as `roll_out` does, under the greedy oracle.

    It sees the truth: of the views not yet taken it goes to the one after which the IoU is
    highest, one step ahead.
    """
    observer, truth = Observer(network, views, bfloat16), views.voxels[objects]
    every = torch.arange(views.images.shape[1]).expand(len(objects), -1)
    fresh = torch.ones_like(every, dtype=torch.bool)
    candidates, hidden = starts[:, None], None
    taken = np.empty((len(objects), 0))
    for _ in range(count):
        seen = _look_at(observer, truth, objects, candidates, hidden, threshold)
        best = seen.best
        chosen = candidates.flatten()[best]
        hidden = rows_of(seen.hidden, best)
        at = views.azimuths[objects, chosen].double().numpy()
        taken = np.column_stack([taken, at])
        own = best.to(seen.logits.device)
        yield Step(seen.logits[own].sigmoid(), seen.folded.latent[own], taken)
        fresh = fresh.scatter(1, chosen[:, None], False)
        if not fresh.any():
            return
        candidates = every[fresh].reshape(len(objects), -1)


def oracle_batch(views: ViewSet) -> int:
    """Return how many episodes of the greedy oracle make a batch of candidates."""
    return max(1, _ROWS // views.images.shape[1])


@torch.inference_mode()
def sequence_iou(network: ReconstructionNetwork, views: ViewSet, item: int, threshold: float,
                 length: int = 3, bfloat16: bool = False) -> NDArray[np.float32]:
    """
    Return the IoU of one object after every ordered sequence of so many views, (V, ..., V).

    Entry [i, j, k] is that of view i, then j, then k: a network may care for the order. NaN where
    a view comes twice. Sequences share what was folded in before: 3 of 24 views are 12,720
    passes.
    """
    count, observer = views.images.shape[1], Observer(network, views, bfloat16)
    table = np.full((count,) * length, np.nan, np.float32)

    def explore(sequences: Tensor, hidden: Any) -> None:
        """Look at all that may follow sequences (P, t), after which the network is `hidden`."""
        taken = torch.zeros(len(sequences), count, dtype=torch.bool).scatter(1, sequences, True)
        fresh = torch.nonzero(~taken)[:, 1].reshape(len(sequences), -1)
        objects = torch.full((len(sequences),), item)
        seen = _look_at(observer, views.voxels[objects], objects, fresh, hidden, threshold)
        longer = torch.cat([sequences.repeat_interleave(fresh.shape[1], dim=0),
                            fresh.reshape(-1, 1)], dim=1)
        if longer.shape[1] == length:
            table[tuple(longer.T.numpy())] = seen.iou.flatten().numpy()
            return
        at_once = max(1, _ROWS // (count - longer.shape[1]))
        for rows in batches(len(longer), at_once):
            explore(longer[rows], rows_of(seen.hidden, rows))

    explore(torch.empty(1, 0, dtype=torch.long), None)
    return table
