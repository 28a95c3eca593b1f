"""Which policies are compared, each under all of its seeds."""

from collections.abc import Sequence
from functools import partial
import hashlib
from pathlib import Path

from active_recon.errors import ConfigError, WeightsError
from active_recon.evaluation.trial import Contender
from active_recon.models.weights import state_hash
from active_recon.models.weights_files import PAPER_MODEL
from active_recon.plugins import installed, POLICIES_GROUP
from active_recon.policies import (
    learned_policy,
    load_policy,
    POLICIES,
    Policy,
    policy_code,
    PolicyOptions,
)
from active_recon.runtimes.torch import TorchPolicyRuntime
import numpy as np
from torch import nn


def heuristic_names() -> list[str]:
    """Return the names of the policies that are not learned and use the cameras only."""
    own = installed(POLICIES_GROUP)  # whose own entry is not known before they are imported
    return [name for name, entry in POLICIES.items()
            if not (entry.is_learned or entry.looks or name in own)]


def contender_names(learned: bool = True, oracle: bool = True) -> list[str]:
    """Return the names of all policies, learned ones last, and 'oracle', which is not a policy."""
    own = [name for name, entry in POLICIES.items() if entry.is_learned and learned]
    return [*heuristic_names(), *own, *(['oracle'] if oracle else [])]


def contenders(names: Sequence[str], attentions: Sequence[nn.Module] = (), count: int = 5,
               seeds: int = 5, seed: int = 0, model: str = PAPER_MODEL,
               weights: Path | None = None) -> list[Contender]:
    """
    Return the policies of these names, each with all of its seeds.

    - attentions: the learned policy's modules, one for each training seed
    - model: name of the network that they were trained with; weights: its file, for policies of
      installed packages
    - count: number of views of an episode, used by uniform
    - seeds: number of runs of random, with seeds from `seed` on

    Raises ConfigError on an unknown name, WeightsError where attention has no module.
    """
    made: list[Contender] = []
    for name in names:
        known = dict.fromkeys((*contender_names(), *POLICIES))
        if name not in known:
            raise ConfigError('policy: no such policy: expected some of '
                              f'{", ".join(known)}, got {name!r}')
        if name not in POLICIES:
            made.append(Contender(name, name, None))
        elif POLICIES[name].is_learned:
            if not attentions:
                raise WeightsError(f'{name}: no view policy: expected weights that contain one, '
                                   'for example of `active-recon train --model 2d3d-attention`, '
                                   'got none')
            made += [Contender(name, f'{name}-{_model_hash(each)}', partial(_learned, model, each))
                     for each in attentions]
        elif POLICIES[name].draws:
            code = policy_code(name, PolicyOptions(views=count, weights=weights))
            made += [Contender(name, f'{name}-{each}',
                               partial(_heuristic, name, count, weights), code)
                     for each in range(seed, seed + seeds)]
        else:
            made.append(Contender(name, name, partial(_heuristic, name, count, weights)))
    return made


def _heuristic(name: str, count: int, weights: Path | None, rng: np.random.Generator) -> Policy:
    return load_policy(name, PolicyOptions(rng, count, weights))


def _learned(model: str, module: nn.Module, rng: np.random.Generator) -> Policy:
    return learned_policy(model, TorchPolicyRuntime(module))


def _model_hash(module: nn.Module) -> str:
    """Return a hash that identifies a learned policy: of its weights and its metadata."""
    facts = sorted(TorchPolicyRuntime(module).facts.items())
    return hashlib.sha256(f'{state_hash(module)} {facts}'.encode()).hexdigest()[:16]
