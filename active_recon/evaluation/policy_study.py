"""Comparison of view policies on one frozen network, including random and the greedy oracle."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
import time
from typing import Any

from active_recon.evaluation.contenders import contender_names, contenders, heuristic_names
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
from active_recon.policies import Choice, Observation, Policy
from active_recon.reporting import Advance, Reporting, silent
from active_recon.runtimes import State
import numpy as np
from torch import nn

_TIMED_EPISODES = 8

Runs = Mapping[str, Sequence[Episodes]]
"""The runs of each policy by its name: the same episodes for each seed."""


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


def study_contenders(trial: Trial, attentions: Sequence[nn.Module],
                     seeds: int) -> list[Contender]:
    """Return what `policy_study` compares."""
    return contenders(contender_names(bool(attentions)), attentions, trial.count, seeds)


def policy_study(trial: Trial, attentions: Sequence[nn.Module] = (), seeds: int = 5,
                 subset_objects: int = 60, reporting: Reporting = silent) -> dict[str, Any]:
    """
    Compare all policies; return `compare` with `identity`, `decision_ms` and `best_subset`.

    - attentions: one for each training seed of the policy, trained with this network
    - seeds: number of runs of random
    - subset_objects: number of objects, spread over the categories, on which every sequence of
      three views is measured; 0 skips this
    """
    every = study_contenders(trial, attentions, seeds)
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
