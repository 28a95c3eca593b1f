"""A view scorer's weights: a file of their own beside those of the network that they belong to."""

from pathlib import Path
from typing import Any

from active_recon.errors import WeightsError
from active_recon.models.companion_weights import Companion
from active_recon.models.view_scorer import ScorerConfig, ViewScorer
from active_recon.models.weights import Bundle
from active_recon.models.weights_files import scorer_path, SHIPPED, weights_hash
from torch import nn


def _build(config: dict[str, Any]) -> ViewScorer:
    return ViewScorer.from_config(ScorerConfig.from_dict(config))


_SCORER = Companion(
    'view-scorer', _build,
    no_such='no view scorer: expected one that `active-recon train-policy` wrote',
    of_others='view policy of other weights',
    advice='train it anew with `active-recon train-policy`, or choose another policy')


def save_scorer(path: Path, scorer: ViewScorer, config: ScorerConfig, network_sha256: str,
                card: dict[str, Any]) -> None:
    """Write `path` (.safetensors, float32) for a network's weights, and the card beside it."""
    _SCORER.save(path, scorer, config, network_sha256, card)


def load_scorer(weights: Path | None = None, device: str = 'cpu') -> ViewScorer:
    """
    Return the scorer of a network's weights, in evaluation mode; None: of those that ship.

    Raises WeightsError where there is none beside them, where it is not whole, and where it was
    trained for other weights: what a view brings depends on the network.
    """
    weights = weights or SHIPPED
    path = scorer_path(weights)
    if not path.is_file():
        raise WeightsError(f'{weights.name}: no view policy in these weights or beside them: '
                           f'expected {path.name}, which `active-recon train-policy` makes; take '
                           'the weights of lifting or 2d3d-attention, or a policy that is not '
                           'learned')
    return _SCORER.read(path, weights_hash(weights), device)


def load_scorer_of_any_network(path: Path) -> ViewScorer:
    """
    Return the scorer in a file, in evaluation mode, whatever weights it was trained for.

    It is no policy of other weights: training can begin with it. Raises WeightsError where it is
    not whole, or no scorer.
    """
    return _SCORER.read(path, None)


def policy_module(weights: Path, bundle: Bundle) -> nn.Module | None:
    """Return the learned policy in weights that were read, or beside them; None without one."""
    if bundle.attention is not None or not scorer_path(weights).is_file():
        return bundle.attention
    return load_scorer(weights)
