"""View policies behind one interface: attention, random, uniform, farthest."""

from pathlib import Path

from active_recon.errors import ConfigError, WeightsError
from active_recon.policies.base import Choice, Policy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
import numpy as np

POLICIES = ('attention', 'random', 'uniform', 'farthest')

__all__ = ['Choice', 'POLICIES', 'Policy', 'load_policy']


def load_policy(name: str, weights: Path | None = None, rng: np.random.Generator | None = None,
                views: int = 5, device: str = 'cpu') -> Policy:
    """
    Return a policy by its name.

    `weights` (None: those that ship) matter to attention, `rng` to random, and `views`, the
    number of views of an episode, to uniform. Raises ConfigError and WeightsError.
    """
    match name:
        case 'random':
            return RandomPolicy(rng or np.random.default_rng())
        case 'uniform':
            return UniformPolicy(views)
        case 'farthest':
            return FarthestPolicy()
        case 'attention':  # the only one that needs a network, and so the seconds to load torch
            from active_recon.models.weights import load_weights
            from active_recon.policies.attention import AttentionPolicy
            model = load_weights(weights, device).attention
            if model is None:
                raise WeightsError(f'{weights}: expected weights with a view policy in them, as '
                                   '`active-recon train --model 2d3d-attention` makes; there is '
                                   'none')
            return AttentionPolicy(model)
    raise ConfigError(f'policy: expected one of {", ".join(POLICIES)}, got {name!r}')
