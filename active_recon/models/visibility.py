"""Visibility: a mean over views, weighted by how well each shows a cell, in any order."""

from torch import Tensor

_MOST_LOGIT = 8.0  # either way: no view outweighs others by more than e^16, and no sum overflows


def add_visible(weight: Tensor, total: Tensor, features: Tensor, logits: Tensor,
                inside: Tensor) -> tuple[Tensor, Tensor]:
    """
    Return the sum of exp(logit), and of exp(logit) times features, with T more views.

    `weight` (B, 1, side, side, side) and `total` (B, C, ...) are the sums so far, 0 before any
    view. Takes features (T, B, C, N), logits (T, B, 1, N), and `inside` (T, B, 1, N), 0 where a
    view does not hold the cell, else 1.
    """
    shares = logits.float().clamp(-_MOST_LOGIT, _MOST_LOGIT).exp() * inside
    return (weight + shares.sum(dim=0).reshape(weight.shape),
            total + (shares * features).sum(dim=0).reshape(total.shape))


def visible_mean(weight: Tensor, total: Tensor) -> Tensor:
    """
    Return the mean of features, (B, C, side, side, side), under a softmax over the views' logits.

    One more slot, of logit 0 and features 0, stands for no view: what no view shows well is 0.
    """
    return total / (1 + weight)
