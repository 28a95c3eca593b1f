"""The choice of a policy, which may be somebody's own, checked before anything follows from it."""

from dataclasses import replace
from typing import Any

from active_recon.errors import ViewError
from active_recon.policies.base import Choice
import numpy as np


def checked_choice(found: Any, count: int) -> tuple[Choice, Any]:
    """
    Return what `choose` returned for one episode and `count` candidates: a Choice and a state.

    Raises ViewError where it is no such pair, a score is not finite, or their number is another.
    """
    try:
        choice, state = found
        scores = np.asarray(choice.scores, np.float32)
        azimuth = (None if choice.azimuth is None
                   else np.asarray(choice.azimuth, np.float64))
    except (AttributeError, TypeError, ValueError) as error:
        raise ViewError('policy: no choice: expected a Choice of arrays, and a state, got: '
                        f'{error}', 'policy') from error
    # An infinite score leaves no order among candidates that motion is taken off from
    if scores.shape != (1, count) or not np.isfinite(scores).all():
        raise ViewError(f'policy: no usable scores: expected (1, {count}) finite numbers, got '
                        f'{scores.shape} with {(~np.isfinite(scores)).sum()} NaN or '
                        'infinite', 'policy')
    if azimuth is not None and (azimuth.shape != (1,) or np.isinf(azimuth).any()):
        raise ViewError('policy: no usable azimuth: expected (1,), radians or NaN, got '
                        f'{azimuth.shape}, {azimuth}', 'policy')
    return replace(choice, scores=scores, azimuth=azimuth), state
