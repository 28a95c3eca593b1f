"""What runs a network: one Protocol, and one module for each library that can."""

from active_recon.runtimes.base import (
    load_policy_runtime,
    load_runtime,
    PolicyRuntime,
    Runtime,
    RUNTIMES,
    State,
)

__all__ = ['PolicyRuntime', 'RUNTIMES', 'Runtime', 'State', 'load_policy_runtime', 'load_runtime']
