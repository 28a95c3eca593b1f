"""Losses of a view scorer: which candidate is better, not by how much."""

from torch import Tensor
from torch.nn import functional

TEMPERATURE = 0.5  # of the gains' distribution, standard deviations


def standardised(gains: Tensor, spread: Tensor) -> Tensor:
    """
    Return gains (B, K) without each state's mean, divided by `spread` (B,); NaN stays.

    The spread is the standard deviation at a number of views: gains after four views are a tenth
    of those after one, and would not count beside them.
    """
    return (gains - gains.nanmean(dim=1, keepdim=True)) / spread[:, None]


def listwise_loss(scores: Tensor, gains: Tensor) -> Tensor:
    """
    Return the cross entropy of the softmax of scores to that of standardised gains, (B,).

    A candidate whose gain is NaN does not count. The loss is lowest where the scores are the
    gains over TEMPERATURE, up to a constant; its own entropy is subtracted, so that it is 0 there.
    """
    known = gains.isfinite()
    wanted = gains.nan_to_num().div(TEMPERATURE).masked_fill(~known, -1e9).log_softmax(dim=1)
    found = scores.masked_fill(~known, -1e9).log_softmax(dim=1)
    return (wanted.exp() * (wanted - found).masked_fill(~known, 0)).sum(dim=1)


def ordinal_loss(scores: Tensor, gains: Tensor) -> Tensor:
    """
    Return the mean logistic loss over pairs of candidates, (B,), weighted by how unequal they are.

    Each pair counts by the difference of its standardised gains, at most 1: which of two equal
    candidates is better is noise. A candidate whose gain is NaN does not count.
    """
    known = gains.isfinite()
    apart = gains.nan_to_num()[:, :, None] - gains.nan_to_num()[:, None]
    weight = apart.clamp(0, 1) * (known[:, :, None] & known[:, None])
    wrong = functional.softplus(scores[:, None] - scores[:, :, None])
    return (weight * wrong).sum(dim=(1, 2)) / weight.sum(dim=(1, 2)).clamp(min=1e-6)
