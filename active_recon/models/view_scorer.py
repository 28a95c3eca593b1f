"""The view scorer: how much each candidate camera would add to a reconstruction."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.network import State
from active_recon.models.sight import cells_in_sight, sampled_cells, upright_frames
import torch
from torch import nn, Tensor
from torch.nn import functional

CHANNELS, GRID, FACTS = 4, 8, 12
"""Channels and cells a side of what a candidate looks at, and numbers beside; see `look`."""
MOST_VIEWS = 6
"""The number of views from which on more are told apart no longer."""
_RAYS, _STEPS = 16, 24  # of a candidate's lines of sight
_VIEW_RAYS, _VIEW_STEPS = 24, 32  # of the views taken, which are few
_DOUBT = 0.6931472  # entropy of p = 0.5, nats


@dataclass(frozen=True)
class ScorerConfig(Config):
    """
    Sizes of the scorer.

    - patches: a side, whose means are what is told of a candidate's grid; hidden: of the layers
    - members: networks whose mean counts
    - dropout: in training
    """

    patches: int = 4
    hidden: int = 128
    members: int = 3
    dropout: float = 0.3

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        if min(self.patches, self.hidden, self.members) < 1 or not 0 <= self.dropout < 1:
            raise ConfigError('ScorerConfig: invalid sizes: expected 1 or more and a dropout in '
                              f'[0, 1), got {self.patches}, {self.hidden}, {self.members} and '
                              f'{self.dropout}')


class Looked(NamedTuple):
    """
    What K candidates look at, of B objects.

    - grids: (B, K, CHANNELS, GRID, GRID, GRID); facts: (B, K, FACTS); see `candidate_grids` and
      `candidate_facts`
    - views: (B,), the number of views taken, at most MOST_VIEWS
    """

    grids: Tensor
    facts: Tensor
    views: Tensor


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
        grids = looked.grids.flatten(0, 1)
        told = torch.cat([
            grids.mean(dim=(2, 3, 4)),
            functional.adaptive_avg_pool3d(grids, self._patches).flatten(1),
            looked.facts.flatten(0, 1)], dim=1)
        own = self.own(self.scale(told)).unflatten(0, (batch, count))
        mean = own.mean(dim=1, keepdim=True)
        found = self.among(torch.cat([own, own - mean], dim=2))[..., 0]
        return found - found.mean(dim=1, keepdim=True), self.all(mean)[:, 0, 0]


class ViewScorer(nn.Module):
    """
    The mean of some members, calibrated to an expected gain of IoU.

    Scores are relative to the mean score; a second output, the level, is of the mean gain.
    `calibration`, (MOST_VIEWS, 3), makes them a gain of IoU: by number of views, a factor of the
    score, one of the level, and an offset.
    """

    def __init__(self, patches: int, hidden: int, members: int, dropout: float) -> None:
        super().__init__()
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
        scores, level = zip(*(member(looked) for member in self.members), strict=True)
        return torch.stack(scores).mean(dim=0), torch.stack(level).mean(dim=0)

    def forward(self, occupancy: Tensor, entropy: Tensor, taken: Tensor, candidates: Tensor,
                state: State) -> tuple[Scored, State]:
        """
        Return the expected gains of candidates (B, K, 4, 4); no state is needed.

        Takes volumes (B, S, S, S): occupancy in [0, 1], the largest of the finer cells, and
        entropy, the mean of the finer cells in nats; and the poses of the views taken,
        (B, t, 4, 4). Lengths of poses count in sides of the grid.
        """
        looked = look(occupancy, entropy, taken, candidates)
        scores, level = self.scores(looked)
        scale, of_level, offset = self.calibration[looked.views - 1].T[..., None]
        return Scored(scale * scores + of_level * level[:, None] + offset), state


def look(occupancy: Tensor, entropy: Tensor, taken: Tensor, candidates: Tensor) -> Looked:
    """Return what candidates look at; for the arguments see `ViewScorer.forward`."""
    candidates = candidates.expand(len(occupancy), *candidates.shape[1:])
    grids, facts = zip(*(
        (candidate_grids(*each), candidate_facts(*each[2:]))
        for each in zip(occupancy, entropy, taken, candidates, strict=True)), strict=True)
    views = torch.full((len(taken),), min(taken.shape[1], MOST_VIEWS), device=taken.device)
    return Looked(torch.stack(grids), torch.stack(facts), views)


def candidate_grids(occupancy: Tensor, entropy: Tensor, taken: Tensor,
                    candidates: Tensor) -> Tensor:
    """
    Return one volume (S, S, S) as K candidates (K, 4, 4) look at it.

    Those are grids (K, CHANNELS, GRID, GRID, GRID) along the candidates' lines of sight: from near
    to far, from top to bottom and from left to right of the image. The channels are occupancy,
    entropy, how much was out of sight of all views taken (t, 4, 4), and the entropy of that.
    """
    side = len(occupancy)
    frames, views = upright_frames(candidates), upright_frames(taken)
    full = functional.pad(occupancy.flatten(), (0, 1))
    seen = cells_in_sight(views, full[sampled_cells(
        views, side, _VIEW_RAYS, _VIEW_STEPS)], side)  # (t, cells)
    missed, doubt = 1 - seen.amax(dim=0), entropy.flatten() / _DOUBT
    # One row for each cell, so that a sample fetches all of it at once
    rows = torch.stack([occupancy.flatten(), doubt, missed, doubt * missed], dim=1)
    cells = sampled_cells(frames, side, _RAYS, _STEPS)
    found = functional.pad(rows, (0, 0, 0, 1))[cells].permute(0, 4, 1, 2, 3)
    return functional.avg_pool3d(found, (_STEPS // GRID, _RAYS // GRID, _RAYS // GRID))


def candidate_facts(taken: Tensor, candidates: Tensor) -> Tensor:
    """
    Return numbers on K candidates' places among the views taken, (K, FACTS).

    Of the angles at the centre to the t views: cosine and sine of the smallest, cosine of the
    largest, mean cosine, largest cosine to the point opposite of a view, its mean square; the
    candidate's sine of elevation and its difference to the views' mean; the number of views
    (1, 2, 3, 4 or more), one by one.
    """
    towards, known = (functional.normalize(poses[:, :3, 3], dim=1)
                      for poses in (candidates, taken))
    cosines = (towards @ known.T).clamp(-1, 1)
    nearest = cosines.amax(dim=1)
    height = towards[:, 2]
    count = functional.one_hot(
        torch.tensor(min(len(taken), 4) - 1, device=taken.device), 4).expand(len(towards), 4)
    return torch.cat([torch.stack([
        nearest, (1 - nearest.square()).clamp(min=0).sqrt(), cosines.amin(dim=1),
        cosines.mean(dim=1), (-cosines).amax(dim=1), cosines.square().mean(dim=1),
        height, height - known[:, 2].mean()], dim=1), count], dim=1)
