"""Which policy `auto` stands for: the learned one of the weights, else an even sweep."""

from dataclasses import dataclass
from pathlib import Path

from active_recon.errors import WeightsError
from active_recon.models.weights_files import read_metadata, SCORER, SHIPPED, weights_hash
from safetensors import safe_open, SafetensorError

AUTO_POLICY = 'auto'
LEARNED_POLICY, SWEEP = 'attention', 'uniform'
_TRAINED_WITH_IT = 'attention.'
"""What the names of the tensors of a policy begin with that lies in its network's own file."""


@dataclass(frozen=True)
class PolicyInUse:
    """The name of a policy, never `auto`; and why it is not the learned one that there is."""

    name: str
    warning: str = ''


def policy_in_use(policy: str, weights: Path | None = None) -> PolicyInUse:
    """
    Return the policy that a name means beside a network's weights; None: those that ship.

    `auto` is the learned policy in the weights, or beside them if it was trained for them; else an
    even sweep. Every other name means itself. Raises WeightsError where `auto` finds no whole
    weights.
    """
    if policy != AUTO_POLICY:
        return PolicyInUse(policy)
    weights = weights or SHIPPED
    read_metadata(weights)
    scorer = weights.with_name(f'{weights.stem}{SCORER}.safetensors')
    if _has_its_own(weights):
        return PolicyInUse(LEARNED_POLICY)
    if not scorer.is_file():
        return PolicyInUse(SWEEP)
    try:
        trained_for = _network_of(scorer)
    except WeightsError as error:
        return _sweep_instead(str(error))
    if trained_for != (own := weights_hash(weights)):
        return _sweep_instead(f'{scorer}: view policy of other weights: expected one trained for '
                              f'{own[:12]}, got one for {trained_for[:12] or "none"}')
    return PolicyInUse(LEARNED_POLICY)


def _sweep_instead(reason: str) -> PolicyInUse:
    return PolicyInUse(SWEEP, (
        f'{reason}; the planner makes an even sweep ({SWEEP}) instead: train it anew with '
        '`active-recon train-policy`, or remove it'))


def _has_its_own(weights: Path) -> bool:
    """Return whether a policy was trained with the network, in one file."""
    with safe_open(weights, framework='np') as stored:
        return any(name.startswith(_TRAINED_WITH_IT) for name in stored.keys())  # noqa: SIM118


def _network_of(scorer: Path) -> str:
    """Return the hash of the weights that a scorer was trained for, '' where it names none."""
    try:
        with safe_open(scorer, framework='np') as stored:
            return str((stored.metadata() or {}).get('network_sha256', ''))
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{scorer}: no whole safetensors file: {error}') from error
