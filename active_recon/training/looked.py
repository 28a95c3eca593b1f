"""States whose gains were measured, as a view scorer looks at them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from active_recon.models.candidate_looks import GRID, look
from active_recon.models.view_scorer import Looked, mirrored, patch_means
from active_recon.policies.candidate_rendering import coarse_volume
from active_recon.training.view_gains import ViewGains
import numpy as np
import torch
from torch import Tensor

_LEAST = 1e-3  # of a standard deviation of gains, IoU


@dataclass(frozen=True, eq=False)
class LookedStates:
    """
    S states with K candidates each: what a scorer sees, and the gains of IoU, (S, K).

    The gain of a view that was taken is NaN.
    """

    looked: Looked
    gains: Tensor

    def __len__(self) -> int:
        """Return S, the number of states."""
        return len(self.gains)

    def rows(self, index: Tensor) -> 'LookedStates':
        """Return some of the states."""
        return LookedStates(Looked(*(part[index] for part in self.looked)), self.gains[index])


def looked_states(measured: ViewGains, patches: int = GRID) -> LookedStates:
    """
    Return the states of one object, with grids of the means of so many patches a side.

    A scorer of so many patches is told no more of them, and learns in less time and memory.
    """
    found = []
    for row in range(len(measured)):
        seen = measured.observation(row)
        assert seen.occupancy is not None
        volume = coarse_volume(seen.occupancy)
        found.append(look(volume.occupancy, volume.entropy, seen.taken, seen.candidates))
    grids, facts, views = (torch.from_numpy(np.concatenate(parts))
                           for parts in zip(*found, strict=True))
    return LookedStates(Looked(patch_means(grids, patches), facts, views.long()),
                        torch.from_numpy(measured.gains))


def joined(parts: Sequence[LookedStates]) -> list[LookedStates]:
    """Return states in as few sets as possible: one for each number of candidates."""
    counts = sorted({part.gains.shape[1] for part in parts})
    sets = []
    for count in counts:
        alike = [part for part in parts if part.gains.shape[1] == count]
        sets.append(LookedStates(
            Looked(*(torch.cat(each) for each in zip(*(part.looked for part in alike),
                                                     strict=True))),
            torch.cat([part.gains for part in alike])))
    return sets


def spreads(sets: Sequence[LookedStates], most: int) -> Tensor:
    """Return the standard deviation of gains within states after 1, 2, ... views, (most,)."""
    squares: list[list[float]] = [[] for _ in range(most)]
    for states in sets:
        apart = states.gains - states.gains.nanmean(dim=1, keepdim=True)
        for views, square in zip(states.looked.views.tolist(),
                                 apart.square().nanmean(dim=1).tolist(), strict=True):
            squares[views - 1].append(square)
    found = [max(float(np.sqrt(np.mean(each))), _LEAST) if each else np.nan for each in squares]
    # A number of views that was never measured is like the last that was
    for place in range(1, most):
        if np.isnan(found[place]):
            found[place] = found[place - 1]
    return torch.tensor(found, dtype=torch.float32).nan_to_num(nan=_LEAST)


def batches_of(sets: Sequence[LookedStates], size: int,
               rng: np.random.Generator) -> Iterator[LookedStates]:
    """Yield all states once, in random batches of one number of candidates each."""
    drawn = [(number, rows) for number, states in enumerate(sets)
             for rows in np.split(rng.permutation(len(states)), range(size, len(states), size))]
    for place in rng.permutation(len(drawn)):
        number, rows = drawn[place]
        yield sets[number].rows(torch.from_numpy(rows))


def mirrored_states(states: LookedStates) -> LookedStates:
    """Return the states of mirrored objects: left is right, gains are the same."""
    return LookedStates(mirrored(states.looked), states.gains)
