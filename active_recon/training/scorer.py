"""Training of a view scorer on measured gains, and what it is worth."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.evaluation.rollouts import batches
from active_recon.models.candidate_looks import MOST_VIEWS
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.training.looked import batches_of, LookedStates, mirrored_states, spreads
from active_recon.training.loop import TrainingDivergedError
from active_recon.training.scorer_losses import listwise_loss, ordinal_loss, standardised
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
import torch
from torch import Tensor

_WARM_UP = 0.1  # share of the steps over which the learning rate rises
_LEAST_SCALE = 1e-4  # of a score: also where nothing is left to gain, candidates have an order


@dataclass(frozen=True)
class ScorerTraining(Config):
    """
    How a scorer is trained.

    - epochs: passes over all states, of which half of the batches are mirrored
    - level_weight: of the squared error of the mean gain, beside the losses of the order
    """

    epochs: int = 40
    batch_size: int = 32
    learning_rate: float = 1.5e-3
    weight_decay: float = 0.1
    level_weight: float = 0.3
    seed: int = 0

    def __post_init__(self) -> None:
        """Reject a training that trains nothing."""
        if min(self.epochs, self.batch_size) < 1:
            raise ConfigError('ScorerTraining: nothing to train: expected 1 epoch and 1 state a '
                              f'batch or more, got {self.epochs} and {self.batch_size}')
        if not 0 < self.learning_rate < math.inf:
            raise ConfigError('ScorerTraining: invalid learning_rate: expected a number above 0, '
                              f'got {self.learning_rate}')


def train_scorer(train: Sequence[LookedStates], config: ScorerConfig, training: ScorerTraining,
                 advance: Callable[[str], None] = lambda note: None,
                 begun: ViewScorer | None = None) -> ViewScorer:
    """
    Return a scorer that learned the order of candidates, in evaluation mode, uncalibrated.

    The losses are listwise and ordinal, on gains standardised per number of views; the mean gain
    is learned beside it. `advance` is called after each epoch with the mean loss. The weights
    begin with those of `begun`, which stays as it is; None: with fresh ones. Raises ConfigError
    where that is of other sizes, TrainingDivergedError where a loss is not finite.
    """
    torch.manual_seed(training.seed)
    rng = np.random.default_rng(training.seed)
    scorer = scorer_to_train(config, begun)
    spread = spreads(train, MOST_VIEWS)
    count = sum(math.ceil(len(states) / training.batch_size) for states in train)
    optimizer = torch.optim.AdamW(scorer.parameters(), training.learning_rate,
                                  weight_decay=training.weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(  # divides by 0 at a warm-up of one step
        optimizer, training.learning_rate, total_steps=max(training.epochs * count, 10) + 1,
        pct_start=_WARM_UP)
    scorer.train()
    for epoch in range(1, training.epochs + 1):
        losses = []
        for batch in batches_of(train, training.batch_size, rng):
            shown = mirrored_states(batch) if rng.random() < 0.5 else batch
            loss = batch_loss(scorer, shown, spread, training.level_weight)
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimizer.step()
            schedule.step()
            losses.append(float(loss.detach()))
        if not np.isfinite(losses).all():
            raise TrainingDivergedError(f'epoch {epoch}: the loss is not finite; try a lower '
                                        'learning rate')
        advance(f'loss {np.mean(losses):.4f}')
    return scorer.eval()


def scorer_to_train(config: ScorerConfig, begun: ViewScorer | None) -> ViewScorer:
    """
    Return a scorer with the weights of `begun`, which stays as it is; None: with fresh ones.

    Raises ConfigError where that is of other sizes.
    """
    scorer = ViewScorer.from_config(config)
    if begun is not None:
        try:
            scorer.load_state_dict(begun.state_dict())
        except RuntimeError as error:
            raise ConfigError('a view scorer of other sizes to begin with: expected those of '
                              f'{config}') from error
    return scorer


def batch_loss(scorer: ViewScorer, batch: LookedStates, spread: Tensor,
               level_weight: float) -> Tensor:
    """Return the loss of a batch; `spread` (MOST_VIEWS,) is that of gains by number of views."""
    own = spread[batch.looked.views - 1]
    wanted, mean = standardised(batch.gains, own), batch.gains.nanmean(dim=1) / own
    losses = []
    for member in scorer.members:  # each learns by itself
        scores, level = member(batch.looked)
        losses.append(listwise_loss(scores, wanted) + ordinal_loss(scores, wanted)
                      + level_weight * (level - mean).square())
    return torch.stack(losses).mean(dim=1).sum()


@torch.inference_mode()
def predict(scorer: ViewScorer, sets: Sequence[LookedStates]) -> list[tuple[Tensor, Tensor]]:
    """Return scores (S, K) and level (S,) of each set of states."""
    found = []
    for states in sets:
        parts = [scorer.scores(states.rows(rows).looked)
                 for rows in batches(len(states), 64)]
        scores, level = zip(*parts, strict=True)
        found.append((torch.cat(scores), torch.cat(level)))
    return found


def gap_shares(scorer: ViewScorer, sets: Sequence[LookedStates]) -> dict[str, float]:
    """
    Return which share of the one-step gap the best score takes: 0 at random, 1 as an oracle.

    That is over all states (`all`) and after 1, 2, ... views: the sum of what the chosen candidate
    brings above the mean of all, over the sum of what the best one does. Labels are noisy, and
    the best of noisy ones is partly luck: 1 is out of reach.
    """
    rows: list[tuple[int, float, float]] = []
    for states, (scores, _) in zip(sets, predict(scorer, sets), strict=True):
        rows += _above_mean(states, scores)
    table = np.array(rows)
    shares = {'all': float(table[:, 1].sum() / max(table[:, 2].sum(), 1e-9))}
    for views in np.unique(table[:, 0]):
        own = table[table[:, 0] == views]
        shares[str(int(views))] = float(own[:, 1].sum() / max(own[:, 2].sum(), 1e-9))
    return shares


def _above_mean(states: LookedStates, scores: Tensor) -> list[tuple[int, float, float]]:
    """Return (views, chosen above mean, best above mean) of each state."""
    known = states.gains.isfinite()
    mean = states.gains.nanmean(dim=1)
    best = states.gains.nan_to_num(nan=-math.inf).amax(dim=1) - mean
    chosen = states.gains.gather(
        1, scores.masked_fill(~known, -math.inf).argmax(dim=1, keepdim=True))[:, 0] - mean
    return list(zip(states.looked.views.tolist(), chosen.tolist(), best.tolist(), strict=True))


def calibrate(scorer: ViewScorer, sets: Sequence[LookedStates]) -> NDArray[np.float64]:
    """
    Fit the scorer's calibration to measured gains, and return it, (MOST_VIEWS, 3).

    By number of views, gain = a * score + b * level + c by least squares, a > 0, b not below 0:
    the mean of what is expected is the mean of what was measured. A number of views that was not
    measured takes the row before it.
    """
    columns: list[list[NDArray[np.float64]]] = [[] for _ in range(MOST_VIEWS)]
    for states, (scores, level) in zip(sets, predict(scorer, sets), strict=True):
        known = states.gains.isfinite()
        levels, views = (each[:, None].expand_as(scores) for each in (level, states.looked.views))
        table = torch.stack([scores[known], levels[known], states.gains[known]], 1).double()
        for number in range(MOST_VIEWS):
            columns[number].append(table[views[known] == number + 1].numpy())
    found = np.tile([1.0, 1.0, 0.0], (MOST_VIEWS, 1))
    for number, parts in enumerate(columns):
        measured = np.concatenate(parts)
        if len(measured):
            found[number] = _least_squares(measured)
        elif number:
            found[number] = found[number - 1]
    scorer.calibration.copy_(torch.from_numpy(found))
    return found


def _least_squares(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a, b >= 0 and c of gain = a * score + b * level + c, of rows (score, level, gain)."""
    middle = table.mean(axis=0)
    scores, level, gain = (table - middle).T
    # Together: without those of the views taken, scores of a state have no mean of 0
    a, b = lsq_linear(np.stack([scores, level], axis=1), gain, ([_LEAST_SCALE, 0], np.inf),
                      method='bvls').x
    return np.array([a, b, middle[2] - a * middle[0] - b * middle[1]])
