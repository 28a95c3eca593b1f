"""Comparison of view policies on one frozen network, including random and the greedy oracle."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
import hashlib
from pathlib import Path
import time
from typing import Any

from active_recon.errors import ConfigError, WeightsError
from active_recon.evaluation.measure import Episodes, summary
from active_recon.evaluation.rollouts import batches, roll_out
from active_recon.evaluation.statistics import (
    by_object,
    difference,
    gap_closed,
    headroom_sentence,
    Values,
)
from active_recon.evaluation.subsets import best_subsets
from active_recon.evaluation.trial import Contender, Trial
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights, state_hash
from active_recon.models.weights_files import PAPER_MODEL
from active_recon.policies import (
    Choice,
    learned_policy,
    load_policy,
    Observation,
    POLICIES,
    Policy,
    PolicyOptions,
)
from active_recon.reporting import Advance, Reporting, silent
from active_recon.runtimes import State
from active_recon.runtimes.torch import TorchPolicyRuntime
import numpy as np
from torch import nn

_TIMED_EPISODES = 8

Runs = Mapping[str, Sequence[Episodes]]
"""The runs of each policy by its name: the same episodes for each seed."""


def heuristic_names() -> list[str]:
    """Return the names of the policies that are not learned."""
    return [name for name, entry in POLICIES.items() if not entry.is_learned]


def contender_names(learned: bool = True, oracle: bool = True) -> list[str]:
    """Return the names of all policies, learned ones last, and 'oracle', which is not a policy."""
    own = [name for name, entry in POLICIES.items() if entry.is_learned and learned]
    return [*heuristic_names(), *own, *(['oracle'] if oracle else [])]


def contenders(names: Sequence[str], attentions: Sequence[nn.Module] = (), count: int = 5,
               seeds: int = 5, seed: int = 0, model: str = PAPER_MODEL) -> list[Contender]:
    """
    Return the policies of these names, each with all of its seeds.

    - attentions: the learned policy's modules, one for each training seed
    - model: name of the network that they were trained with
    - count: number of views of an episode, used by uniform
    - seeds: number of runs of random, with seeds from `seed` on

    Raises ConfigError on an unknown name, WeightsError where attention has no module.
    """
    made: list[Contender] = []
    for name in names:
        if name not in contender_names():
            raise ConfigError('policy: no such policy: expected some of '
                              f'{", ".join(contender_names())}, got {name!r}')
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
            made += [Contender(name, f'{name}-{each}', partial(_heuristic, name, count))
                     for each in range(seed, seed + seeds)]
        else:
            made.append(Contender(name, name, partial(_heuristic, name, count)))
    return made


def load_attentions(files: Sequence[Path], network: ReconstructionNetwork) -> list[nn.Module]:
    """
    Return the attention modules of weights files that were trained with this network.

    Raises WeightsError where a file has none, or one trained with another network, whose latents
    differ.
    """
    models = []
    for file in files:
        bundle = load_weights(file)
        if bundle.attention is None:
            raise WeightsError(f'{file}: no view policy: expected weights that contain one, got '
                               'none')
        if state_hash(bundle.reconstruction) != state_hash(network):
            raise WeightsError(f'{file}: view policy of another network: expected one trained '
                               'with the network that is measured, got one of another; train it '
                               'with `active-recon train --freeze-from` and that network')
        models.append(bundle.attention)
    return models


def run_all(trial: Trial, every: Sequence[Contender], reporting: Reporting = silent) -> Runs:
    """Run the episodes of all contenders; return the runs by policy."""
    runs: dict[str, list[Episodes]] = {}
    for contender in every:
        with reporting(contender.key, len(trial.objects)) as advance:
            run = trial.run(contender, partial(_advance, advance))
        runs.setdefault(contender.policy, []).append(run)
    return runs


def compare(trial: Trial, runs: Runs) -> dict[str, Any]:
    """
    Return the results of every policy and their differences, ready for JSON.

    - policies: see `measure.summary`; `auc_above` is the paired difference of the area under the
      IoU curve to those of random, uniform and farthest; `gap_closed` is the fraction of the gap
      between random and the oracle, None where there is no gap
    - headroom: the oracle's area minus random's; headroom_sentence states it in words

    All intervals are of 95 %, over objects, starts and seeds.
    """
    areas = {name: _areas(trial, seeds) for name, seeds in runs.items()}
    policies = {name: summary(seeds, trial.views, trial.objects) for name, seeds in runs.items()}
    for name, figures in policies.items():
        figures['auc_above'] = {other: asdict(difference(areas[name], areas[other]))
                                for other in heuristic_names() if other in areas and other != name}
    found: dict[str, Any] = {'policies': policies}
    if 'random' in areas and 'oracle' in areas:
        for name, figures in policies.items():
            share = gap_closed(areas[name], areas['random'], areas['oracle'])
            figures['gap_closed'] = share and asdict(share)
        headroom = difference(areas['oracle'], areas['random'])
        found |= {'headroom': asdict(headroom), 'headroom_sentence': headroom_sentence(headroom)}
    return found


def decision_ms(trial: Trial, contender: Contender) -> float | None:
    """Return the median time of one decision in one episode, milliseconds; None for the oracle."""
    if contender.make is None:
        return None
    watch = _Stopwatch(contender.make(np.random.default_rng(0)))
    for row in batches(min(len(trial.objects), _TIMED_EPISODES), 1):
        for _ in roll_out(trial.network, watch, trial.views, trial.objects[row],
                          trial.starts[row], max(trial.count, 2)):
            pass
    return float(np.median(watch.milliseconds))


def policy_study(trial: Trial, attentions: Sequence[nn.Module] = (), seeds: int = 5,
                 subset_objects: int = 60, reporting: Reporting = silent) -> dict[str, Any]:
    """
    Compare all policies; return `compare` with `identity`, `decision_ms` and `best_subset`.

    - attentions: one for each training seed of the policy, trained with this network
    - seeds: number of runs of random
    - subset_objects: number of objects, spread over the categories, on which every sequence of
      three views is measured; 0 skips this
    """
    every = contenders(contender_names(bool(attentions)), attentions, trial.count, seeds)
    runs = run_all(trial, every, reporting)
    found: dict[str, Any] = {
        'identity': trial.identity, 'objects': len(trial.views),
        'episodes': len(trial.objects), **compare(trial, runs)}
    first = {contender.policy: contender for contender in reversed(every)}
    for name, figures in found['policies'].items():
        figures['decision_ms'] = decision_ms(trial, first[name])
    if subset_objects:
        with reporting('sequences of three views', subset_objects) as advance:
            found['best_subset'] = best_subsets(
                trial, runs, subset_objects, lambda: advance(1, ''))
    return found


def _heuristic(name: str, count: int, rng: np.random.Generator) -> Policy:
    return load_policy(name, PolicyOptions(rng, count))


def _learned(model: str, module: nn.Module, rng: np.random.Generator) -> Policy:
    return learned_policy(model, TorchPolicyRuntime(module))


def _model_hash(module: nn.Module) -> str:
    """Return a hash that identifies a learned policy: of its weights and its metadata."""
    facts = sorted(TorchPolicyRuntime(module).facts.items())
    return hashlib.sha256(f'{state_hash(module)} {facts}'.encode()).hexdigest()[:16]


def _advance(advance: Advance, done: int) -> None:
    advance(done, '')


def _areas(trial: Trial, seeds: Sequence[Episodes]) -> Values:
    return np.stack([by_object(run.auc, trial.objects.numpy()) for run in seeds], axis=2)


class _Stopwatch:
    """A policy whose decisions are timed."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self.milliseconds: list[float] = []

    @property
    def wants_volume(self) -> bool:
        """Whether the policy uses the occupancy."""
        return self._policy.wants_volume

    def initial_state(self, batch: int) -> State:
        """Return the policy's initial state."""
        return self._policy.initial_state(batch)

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Return the policy's choice, and record its time."""
        begun = time.perf_counter()
        chosen = self._policy.choose(seen, state)
        self.milliseconds.append(1e3 * (time.perf_counter() - begun))
        return chosen
