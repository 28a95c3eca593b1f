"""View policies behind one interface, and the one registry of them."""

from active_recon.policies.automatic import AUTO_POLICY, policy_in_use, PolicyInUse
from active_recon.policies.base import Choice, Observation, Policy
from active_recon.policies.registry import (
    learned_policy,
    load_policy,
    POLICIES,
    policy_code,
    PolicyEntry,
    PolicyOptions,
)

__all__ = ['AUTO_POLICY', 'Choice', 'Observation', 'POLICIES', 'Policy', 'PolicyEntry',
           'PolicyInUse', 'PolicyOptions', 'learned_policy', 'load_policy', 'policy_code',
           'policy_in_use']
