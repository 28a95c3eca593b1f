"""View policies behind one interface, and the one registry of them."""

from active_recon.policies.base import Choice, Observation, Policy
from active_recon.policies.registry import (
    DEFAULT_POLICY,
    learned_policy,
    load_policy,
    POLICIES,
    PolicyEntry,
    PolicyOptions,
)

__all__ = ['Choice', 'DEFAULT_POLICY', 'Observation', 'POLICIES', 'Policy', 'PolicyEntry',
           'PolicyOptions', 'learned_policy', 'load_policy']
