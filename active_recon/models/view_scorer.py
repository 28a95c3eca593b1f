"""The view scorer: how much each candidate camera would add to a reconstruction."""

from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.candidate_looks import CHANNELS, FACTS, GRID, MOST_VIEWS
from active_recon.models.network import State
import numpy as np
from numpy.typing import NDArray
import torch
from torch import nn, Tensor


@dataclass(frozen=True)
class ScorerConfig(Config):
    """
    Sizes of the scorer.

    - patches: a side, whose means are what is told of a candidate's grid; hidden: of the layers
    - members: networks whose mean counts
    - dropout: in training
    """

    patches: int = 4
    hidden: int = 256
    members: int = 3
    dropout: float = 0.3

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        if min(self.patches, self.hidden, self.members) < 1 or not 0 <= self.dropout < 1:
            raise ConfigError('ScorerConfig: invalid sizes: expected 1 or more and a dropout in '
                              f'[0, 1), got {self.patches}, {self.hidden}, {self.members} and '
                              f'{self.dropout}')
        if GRID % self.patches:
            raise ConfigError(f'ScorerConfig: invalid patches: expected a divisor of {GRID}, got '
                              f'{self.patches}')


class Looked(NamedTuple):
    """
    What K candidates look at, of B objects: `candidate_looks.Looks` in tensors.

    - grids: (B, K, CHANNELS, GRID, GRID, GRID), or the means of the scorer's patches of them
    - facts: (B, K, FACTS)
    - views: (B,) int64, the number of views taken, at most MOST_VIEWS
    """

    grids: Tensor
    facts: Tensor
    views: Tensor


def mirrored(looked: Looked) -> Looked:
    """Return what candidates look at where all objects and cameras are mirrored."""
    return looked._replace(grids=looked.grids.flip(-1))


class Scored(NamedTuple):
    """The output: the expected gain of IoU of each candidate, (B, K)."""

    gain: Tensor


class ScorerMember(nn.Module):
    """
    One small network for each candidate, and what the candidates have in common beside it.

    A candidate's grid is told by the means of its patches, beside the facts. Each candidate is
    also told what it has beyond the mean of all candidates, so that the order of the candidates
    and their number make no difference.
    """

    def __init__(self, patches: int, hidden: int, dropout: float) -> None:
        super().__init__()
        told = CHANNELS * (1 + patches ** 3) + FACTS
        self._patches = patches
        self.scale = nn.BatchNorm1d(told)
        self.own = nn.Sequential(nn.Linear(told, hidden), nn.ReLU(), nn.Dropout(dropout))
        self.among = nn.Sequential(nn.Linear(2 * hidden, hidden), nn.ReLU(), nn.Dropout(dropout),
                                   nn.Linear(hidden, 1))
        self.all = nn.Linear(hidden, 1)

    def forward(self, looked: Looked) -> tuple[Tensor, Tensor]:
        """Return scores (B, K), whose mean is 0, and the level of the mean gain, (B,)."""
        batch, count = looked.facts.shape[:2]
        grids = patch_means(looked.grids, self._patches).flatten(0, 1).flatten(2)
        told = torch.cat([grids.mean(dim=2), grids.flatten(1), looked.facts.flatten(0, 1)], dim=1)
        own = self.own(self.scale(told)).unflatten(0, (batch, count))
        mean = own.mean(dim=1, keepdim=True)
        found = self.among(torch.cat([own, own - mean], dim=2))[..., 0]
        return found - found.mean(dim=1, keepdim=True), self.all(mean)[:, 0, 0]


class ViewScorer(nn.Module):
    """
    The mean of some members, calibrated to an expected gain of IoU.

    Each member looks twice, the second time at the mirrored objects, since there every view brings
    as much: mirrored objects and cameras have the same scores.
    Scores are relative to the mean score; a second output, the level, is of the mean gain.
    `calibration`, (MOST_VIEWS, 3), makes them a gain of IoU: by number of views, a factor of the
    score, one of the level, and an offset.
    """

    def __init__(self, patches: int, hidden: int, members: int, dropout: float) -> None:
        super().__init__()
        self._patches = patches
        self.members = nn.ModuleList(
            ScorerMember(patches, hidden, dropout) for _ in range(members))
        self.calibration: Tensor
        self.register_buffer('calibration', torch.tensor([1.0, 1, 0]).repeat(MOST_VIEWS, 1))

    @classmethod
    def from_config(cls, config: ScorerConfig) -> 'ViewScorer':
        """Build the scorer of a configuration, with fresh weights."""
        return cls(config.patches, config.hidden, config.members, config.dropout)

    @property
    def facts(self) -> dict[str, Any]:
        """No constants that a policy needs."""
        return {}

    def initial_state(self, batch: int) -> State:
        """Return no state: everything is in the volume and in the views taken."""
        return {}

    def scores(self, looked: Looked) -> tuple[Tensor, Tensor]:
        """Return the members' mean scores (B, K), whose mean is 0, and mean level (B,)."""
        told = looked._replace(grids=patch_means(looked.grids, self._patches))
        scores, level = zip(*(member(each) for each in (told, mirrored(told))
                              for member in self.members), strict=True)
        return torch.stack(scores).mean(dim=0), torch.stack(level).mean(dim=0)

    def forward(self, grids: Tensor, facts: Tensor, views: Tensor,
                state: State) -> tuple[Scored, State]:
        """
        Return the expected gains of candidates, (B, K); no state is needed.

        The arguments are those of `candidate_looks.Looks`.
        """
        scores, level = self.scores(Looked(grids, facts, views.long()))
        scale, of_level, offset = self.calibration[views.long() - 1].T[..., None]
        return Scored(scale * scores + of_level * level[:, None] + offset), state


def patch_means(grids: Tensor, patches: int) -> Tensor:
    """Return the means of so many patches a side of grids (..., S, S, S), a multiple of them."""
    side = grids.shape[-1]
    if side == patches:
        return grids
    # As a product of matrices: in a twentieth of the time of a mean over three axes
    found = grids.flatten(-3) @ torch.from_numpy(_pooling(side, patches)).to(grids)
    return found.reshape(*grids.shape[:-3], patches, patches, patches)


@cache
def _pooling(side: int, patches: int) -> NDArray[np.float32]:
    """Return what makes cells, (side ** 3,), the means of patches, as a matrix."""
    along = np.repeat(np.eye(patches, dtype=np.float32), side // patches, axis=0)
    along *= np.float32(patches / side)
    return np.kron(np.kron(along, along), along)
