"""The choice of a policy, which may be somebody's own, checked before anything follows from it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from active_recon.errors import ActiveReconError, ViewError
from active_recon.policies.base import Choice, Observation, Policy
import numpy as np

FAULT = 'policy'
"""The kind of an error that a policy of somebody's own makes."""


def checked_choice(found: Any, count: int, batch: int = 1) -> tuple[Choice, Any]:
    """
    Return what `choose` returned for so many episodes and candidates: a Choice, a state.

    Raises ViewError where it is no such pair, a score is not finite, or their number is another.
    """
    try:
        choice, state = found
        scores = np.asarray(choice.scores, np.float32)
        azimuth = (None if choice.azimuth is None
                   else np.asarray(choice.azimuth, np.float64))
    except (AttributeError, TypeError, ValueError) as error:
        raise ViewError('policy: no choice: expected a Choice of arrays, and a state, got: '
                        f'{error}', FAULT) from error
    # An infinite score leaves no order among candidates that motion is taken off from
    if scores.shape != (batch, count) or not np.isfinite(scores).all():
        raise ViewError(f'policy: no usable scores: expected ({batch}, {count}) finite numbers, '
                        f'got {scores.shape} with {(~np.isfinite(scores)).sum()} NaN or '
                        'infinite', FAULT)
    if azimuth is not None and (azimuth.shape != (batch,) or np.isinf(azimuth).any()):
        raise ViewError(f'policy: no usable azimuth: expected ({batch},), radians or NaN, got '
                        f'{azimuth.shape}, {azimuth}', FAULT)
    return replace(choice, scores=scores, azimuth=azimuth), state


def begun_by(policy: Policy, batch: int = 1) -> Any:
    """Return a policy's state of so many episodes before any view; raises ViewError likewise."""
    with telling_failures('policy: initial_state'):
        return policy.initial_state(batch)


def chosen(policy: Policy, seen: Observation, state: Any, batch: int = 1) -> tuple[Choice, Any]:
    """Return what a policy chooses for so many episodes; raises ViewError where it fails, too."""
    with telling_failures('policy:'):
        found = policy.choose(seen, state)
    return checked_choice(found, seen.candidates.shape[1], batch)


@contextmanager
def telling_failures(what: str) -> Iterator[None]:
    """Turn whatever a policy of somebody's own raises in the block into a ViewError."""
    try:
        yield
    except ActiveReconError:
        raise
    except Exception as error:
        raise ViewError(f'{what} fails with {type(error).__name__}: {error}', FAULT) from error


@contextmanager
def naming(name: str) -> Iterator[None]:
    """Name the policy, one of several, that fails in the block."""
    try:
        yield
    except ViewError as error:
        if error.kind != FAULT:
            raise
        raise ViewError(f'{name}: {error}', FAULT) from error
