"""Loads the policy that the planner's parameters name, and tells which it is."""

from dataclasses import dataclass
import math

from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.parameters import set_read_only_parameter
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.policies import (
    load_policy,
    POLICIES,
    Policy,
    policy_in_use,
    PolicyInUse,
    PolicyOptions,
)
from active_recon.policies.automatic import LEARNED_POLICY
import numpy as np

_WARNING, _OTHER_NETWORK, _OTHER_SIZE = 'learned_policy', 'weights', 'object_size'


@dataclass(frozen=True, eq=False)
class LoadedPolicy:
    """
    A policy, what it is called, and the parameters by which it was loaded.

    `network` is the SHA-256 of the weights that it was trained for; '' of one that is not learned.
    """

    policy: Policy
    in_use: PolicyInUse
    params: ViewPlannerParameters
    network: str


def loaded_policy(params: ViewPlannerParameters, before: LoadedPolicy | None = None
                  ) -> LoadedPolicy:
    """Load a policy, unless the one before is the same; raises ConfigError and WeightsError."""
    weights = find_weights(params.weights or None)
    if before is not None and before.params.policy == params.policy:
        in_use = before.in_use
    else:
        in_use = policy_in_use(params.policy, weights)
    if before is not None and before.in_use.name == in_use.name and all(
            getattr(before.params, name) == getattr(params, name)
            for name in POLICIES[in_use.name].parameters):
        return LoadedPolicy(before.policy, in_use, params, before.network)
    policy = load_policy(in_use.name, PolicyOptions(
        np.random.default_rng(params.seed), params.max_views, weights, params.runtime,
        threads=params.threads, precision=params.precision))
    return LoadedPolicy(policy, in_use, params,
                        weights_hash(weights) if in_use.name == LEARNED_POLICY else '')


def tell_policy(node: ManagedNode, diagnostics: Diagnostics, in_use: PolicyInUse) -> None:
    """Tell which policy chooses, in the log, the diagnostics and the parameter that bags keep."""
    set_read_only_parameter(
        node, 'policy_in_use', in_use.name, 'policy that chooses the next view')
    diagnostics.set_value('Policy', in_use.name)
    node.get_logger().info(f'policy {in_use.name}')
    if in_use.warning:
        diagnostics.raise_warning(_WARNING, in_use.warning)
    else:
        diagnostics.clear_warning(_WARNING)


def tell_reconstructor(diagnostics: Diagnostics, loaded: LoadedPolicy, weights_sha256: str,
                       object_size: float | None) -> None:
    """Warn where the reconstructor told of other weights or another cube than the planner has."""
    _tell_network(diagnostics, loaded, weights_sha256)
    _tell_size(diagnostics, loaded.params.object_size, object_size)


def _tell_network(diagnostics: Diagnostics, loaded: LoadedPolicy, weights_sha256: str) -> None:
    """Warn where the reconstructor has other weights than the policy was trained for."""
    if loaded.network and weights_sha256 and loaded.network != weights_sha256:
        diagnostics.raise_warning(_OTHER_NETWORK, (
            f'the policy {loaded.in_use.name} was trained for the weights {loaded.network[:12]}: '
            f'expected the reconstructor to have them, got {weights_sha256[:12]}; set `weights` '
            'of both nodes to the same'))
    else:
        diagnostics.clear_warning(_OTHER_NETWORK)


def _tell_size(diagnostics: Diagnostics, own: float, told: float | None) -> None:
    """Warn where the reconstructor's cube has another side in metres than the planner's."""
    if told is not None and not math.isclose(own, told):
        diagnostics.raise_warning(_OTHER_SIZE, (
            f'object_size: expected that of the reconstructor, {told:g} m, got {own:g}: goals are '
            'planned for another cube; set it in both nodes to the same'))
    else:
        diagnostics.clear_warning(_OTHER_SIZE)
