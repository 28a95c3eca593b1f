"""All view policies by their names, and what each is made of."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.models.weights_files import read_metadata, SHIPPED
from active_recon.plugins import (
    code_hash,
    file_hash,
    installed,
    load_installed,
    POLICIES_GROUP,
)
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.automatic import AUTO_POLICY, policy_in_use
from active_recon.policies.base import Policy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
from active_recon.policies.rendered import (
    rendered_uncertainty,
    RenderedPolicy,
    unseen_entropy,
    visible_entropy,
)
from active_recon.runtimes import AUTO, load_policy_runtime, PolicyRuntime
import numpy as np


@dataclass(frozen=True)
class PolicyOptions:
    """
    What policies are made of.

    `views` of an episode; `weights` None: those that ship; `runtime`, `device`, `threads` and
    `precision` of what runs a learned policy, see `load_runtime`.
    """

    rng: np.random.Generator = field(default_factory=np.random.default_rng)
    views: int = 5
    weights: Path | None = None
    runtime: str = AUTO
    device: str = 'cpu'
    threads: int | None = None
    precision: str = 'auto'


@dataclass(frozen=True)
class PolicyEntry:
    """
    How a policy is made.

    - parameters: those of the planner that it depends on, beside its name: a change of one of
      them makes it anew; one of `seed` draws, one of `weights` is learned
    - looks: whether it looks at the probabilities, and not at the cameras alone
    """

    make: Callable[[PolicyOptions], Policy]
    parameters: tuple[str, ...] = ()
    looks: bool = False

    @property
    def is_learned(self) -> bool:
        """Whether it comes with the weights of a network."""
        return 'weights' in self.parameters

    @property
    def draws(self) -> bool:
        """Whether it differs from seed to seed."""
        return 'seed' in self.parameters


LEARNED: dict[str, Callable[[PolicyRuntime], Policy]] = {'2d3d-attention': AttentionPolicy}
"""
What makes a policy of the model that was trained with a network, by the network's name.

Of all others it is a ScoringPolicy: of the scorer that `active-recon train-policy` made for them.
"""


def learned_policy(model: str, runtime: PolicyRuntime) -> Policy:
    """Return the policy of the model that was trained for a network of this name."""
    from active_recon.policies.scoring import ScoringPolicy  # a third of a command's start

    return LEARNED.get(model, ScoringPolicy)(runtime)


def _attention(options: PolicyOptions) -> Policy:
    model = read_metadata(options.weights or SHIPPED).model
    return learned_policy(model, load_policy_runtime(
        options.weights, options.runtime, options.device, options.threads, options.precision))


POLICIES: dict[str, PolicyEntry] = {
    'attention': PolicyEntry(_attention, ('weights',)),
    'random': PolicyEntry(lambda options: RandomPolicy(options.rng), ('seed',)),
    'uniform': PolicyEntry(lambda options: UniformPolicy(options.views), ('max_views',)),
    'farthest': PolicyEntry(lambda options: FarthestPolicy()),
    'visible_entropy': PolicyEntry(lambda options: RenderedPolicy(visible_entropy), looks=True),
    'unseen_entropy': PolicyEntry(lambda options: RenderedPolicy(unseen_entropy), looks=True),
    'rendered_uncertainty': PolicyEntry(
        lambda options: RenderedPolicy(rendered_uncertainty), looks=True),
}


_PARTS = ('wants_volume', 'initial_state', 'choose')


def _installed(name: str) -> Callable[[PolicyOptions], Policy]:
    """Return what makes a policy of an installed package, imported when it is made."""
    def make(options: PolicyOptions) -> Policy:
        found = load_installed(POLICIES_GROUP, name)
        try:
            made: Policy = found.make(options) if isinstance(found, PolicyEntry) else found()
        except ActiveReconError:
            raise
        except Exception as error:  # whatever the package raises
            raise ConfigError(f'{name}: cannot be made: expected a callable without arguments '
                              f'that returns a policy, or a PolicyEntry, got '
                              f'{type(error).__name__}: {error}') from error
        if lacking := [part for part in _PARTS if not hasattr(made, part)]:
            raise ConfigError(f'{name}: no policy: expected one with {", ".join(_PARTS)}, got a '
                              f'{type(made).__name__} without {", ".join(lacking)}')
        return made
    return make


POLICIES |= {name: PolicyEntry(_installed(name), ('seed', 'max_views'))
             for name in installed(POLICIES_GROUP) if name not in POLICIES}


def load_policy(name: str, options: PolicyOptions | None = None) -> Policy:
    """Return a policy by its name, or `auto`; raises ConfigError and WeightsError."""
    options = options or PolicyOptions()
    if name not in (AUTO_POLICY, *POLICIES):
        raise ConfigError(f'no policy is called {name!r}: expected one of '
                          f'{", ".join((AUTO_POLICY, *POLICIES))}, or that of a package that is '
                          'installed here')
    return POLICIES[policy_in_use(name, options.weights).name].make(options)


def policy_code(name: str, options: PolicyOptions | None = None) -> str:
    """Return the hash of the code of an installed package's policy, '' for one of ours."""
    if name not in installed(POLICIES_GROUP):
        return ''
    made = load_policy(name, options)
    # Its class may be one of ours, made of the package's functions
    return code_hash(made) or file_hash(installed(POLICIES_GROUP)[name].module)
