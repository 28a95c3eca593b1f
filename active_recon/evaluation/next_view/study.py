"""Policies, a sequence and oracles on one frozen network: what each gains, how much repeats."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
import math
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.errors import ConfigError
from active_recon.evaluation.next_view.choosing import (
    chosen_ahead,
    chosen_by,
    chosen_together,
    judged,
    motion_time,
    Order,
)
from active_recon.evaluation.next_view.fixed_sequence import find_sequence, FixedSequence, Offsets
from active_recon.evaluation.next_view.renderings import another_rendering
from active_recon.evaluation.next_view.swapping import swapped_row, turned
from active_recon.evaluation.next_view.watching import Ahead, WatchedObject
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.scene import Scene
from active_recon.evaluation.posed.walking import some_objects
from active_recon.evaluation.statistics import (
    difference,
    gap_closed,
    mean_interval,
    Values,
    views_to_reach,
)
from active_recon.policies import load_policy, POLICIES, Policy, PolicyOptions
from active_recon.policies.checked import naming
import numpy as np
import torch

ORACLE, PEEKING, SEQUENCE, TOGETHER = 'oracle', 'peeking', 'sequence', 'together'
SWAPPED, SWAPPED_TURNED = 'swapped', 'swapped_turned'
_LOOKS_ELSEWHERE = 'attention'  # the policy that these two are
_WORTH: dict[str, Callable[[Ahead], Values]] = {
    ORACLE: lambda ahead: ahead.iou, PEEKING: lambda ahead: ahead.expected}
_ON_BOTH = ('random', ORACLE)  # the gap between them is told on either rendering


@dataclass(frozen=True)
class Episodes:
    """
    What is run of every object.

    - policies: names of the registry, `sequence`, `swapped`, `swapped_turned`, `peeking`, `oracle`
      and `together`, see `chosen_together`; NAME@COST is a policy with a `motion_cost`, see
      `chosen_by`
    - starts: first views of each object, drawn; count: views of an episode
    - seeds: how often a policy that draws is run
    - seed: draws the starts, the renderings and what policies draw
    """

    policies: tuple[str, ...]
    starts: int = 2
    count: int = 5
    seeds: int = 3
    seed: int = 0
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Reject policies that there are not, none at all, and episodes without a choice."""
        known = known_names()
        if not self.policies:
            raise ConfigError(f'policies: none: expected some of {", ".join(known)}, got no name')
        if unknown := [name for name in self.policies if _parted(name)[0] not in known]:
            raise ConfigError(f'policies: no such policy: expected some of {", ".join(known)}, '
                              f'got {unknown[0]!r}')
        if ahead := [name for name in self.policies
                     if '@' in name and _parted(name)[0] in (*_WORTH, TOGETHER)]:
            raise ConfigError('policies: no cost of motion: expected NAME@COST of a policy, and '
                              f'peeking, oracle and together without, got {ahead[0]!r}')
        if self.count < 2:
            raise ConfigError('views: nothing to choose: expected 2 views of an episode or more, '
                              f'got {self.count}')


@dataclass(frozen=True, eq=False)
class Found:
    """
    The IoU of episodes by policy, (objects, starts, seeds, T) each.

    `same`: on the rendering on which views were chosen, of random and the oracle alone; `other`:
    on another rendering of the same views. `motion`: the time that the motion takes, seconds at
    1 rad/s, (objects, starts, seeds).
    """

    same: Mapping[str, Values]
    other: Mapping[str, Values]
    motion: Mapping[str, Values]


def known_names() -> list[str]:
    """Return what can be measured: all policies, learned ones if there are any, and more."""
    return [*POLICIES, SEQUENCE, SWAPPED, SWAPPED_TURNED, PEEKING, ORACLE, TOGETHER]


def require_policies(entrant: Entrant, episodes: Episodes) -> None:
    """Raise as `load_policy` where a policy cannot be had, as a learned one of its weights."""
    for name in episodes.policies:
        plain, _ = _parted(name)
        if plain in (*POLICIES, SWAPPED, SWAPPED_TURNED):
            _policy(plain, [episodes.seed], entrant, episodes, None)


def shown_views(scene: Scene, entrant: Entrant) -> ViewSet:
    """Return the views of a set for a network; raises ConfigError where it cannot use them."""
    shown = scene.shown_to(entrant.network)
    if shown is None:
        raise ConfigError(f'{entrant.name}: cannot be shown these views: expected a network that '
                          'takes any cameras, such as lifting')
    return shown


def find_offsets(scene: Scene, entrant: Entrant, episodes: Episodes,
                 advance: Callable[[int], None] = lambda done: None) -> Offsets:
    """Return the best sequence of views that is the same for all of a set's objects."""
    rows = range(len(scene))
    return find_sequence([_watched(scene, entrant, episodes, row, None) for row in rows],
                         [_starts(scene, episodes, row)[0] for row in rows], episodes.count,
                         advance)


def run_episodes(scene: Scene, entrant: Entrant, episodes: Episodes,
                 offsets: Offsets | None = None,
                 advance: Callable[[int], None] = lambda done: None) -> Found:
    """
    Choose the views of all episodes on one rendering of the objects, and judge them on another.

    A choice by luck is no better on the other rendering than any other choice.
    """
    same: dict[str, list[Values]] = {name: [] for name in episodes.policies}
    others: dict[str, list[Values]] = {name: [] for name in episodes.policies}
    motion: dict[str, list[Values]] = {name: [] for name in episodes.policies}
    for row in range(len(scene)):
        own, other = (_watched(scene, entrant, episodes, row, 2 * episodes.seed + rendering)
                      for rendering in range(2))
        for name in episodes.policies:
            plain, _ = _parted(name)
            looked_at = own if plain not in (SWAPPED, SWAPPED_TURNED) else _watched(
                scene, entrant, episodes, swapped_row(row, len(scene)), 2 * episodes.seed,
                np.random.default_rng([episodes.seed, row, 1])
                if plain == SWAPPED_TURNED else None)
            orders = [[_order(name, looked_at, start, [episodes.seed, seed, row, start], entrant,
                              episodes, offsets)
                       for seed in range(_seeds(name, episodes))]
                      for start in _starts(scene, episodes, row)]
            others[name].append(_judged(other, orders))
            motion[name].append(np.array([[motion_time(own, order) for order in seeds]
                                          for seeds in orders]))
            if name in _ON_BOTH:
                same[name].append(_judged(own, orders))
        advance(1)
    return Found({name: np.array(rows) for name, rows in same.items() if rows},
                 {name: np.array(rows) for name, rows in others.items()},
                 {name: np.array(rows) for name, rows in motion.items()})


def figures(found: Found) -> dict[str, Any]:
    """
    Return what is said of episodes, with 95 % intervals over objects and starts, ready for JSON.

    - policies: the IoU after each view, and the area under that curve (its mean), on the other
      rendering; `ahead` of other policies, paired by object and start; `share` of the repeatable
      gap, None where it is not surely there; `views_for_random`: after how many views it is where
      random ends; `motion_s`: the time of the motion
    - gap: what the oracle is ahead of random, `same`: on the rendering that it chose on;
      `repeatable`: on the other one
    """
    areas = {name: values.mean(axis=3) for name, values in found.other.items()}
    has_gap = {'random', ORACLE} <= areas.keys()
    policies: dict[str, Any] = {}
    for name, values in found.other.items():
        policies[name] = {
            'iou': [asdict(mean_interval(of_view)) for of_view in np.moveaxis(values, 3, 0)],
            'area': asdict(mean_interval(areas[name])),
            'ahead': {rival: asdict(difference(areas[name], areas[rival]))
                      for rival in areas if rival != name},
            'motion_s': asdict(mean_interval(found.motion[name]))}
        if 'random' in found.other:
            policies[name]['views_for_random'] = asdict(
                views_to_reach(values, found.other['random']))
        if has_gap:
            share = gap_closed(areas[name], areas['random'], areas[ORACLE])
            policies[name]['share'] = share and asdict(share)
    if not has_gap:
        return {'policies': policies}
    same = {name: values.mean(axis=3) for name, values in found.same.items()}
    return {'policies': policies, 'gap': {
        'same': asdict(difference(same[ORACLE], same['random'])),
        'repeatable': asdict(difference(areas[ORACLE], areas['random']))}}


def _judged(watched: WatchedObject, orders: Sequence[Sequence[Order]]) -> Values:
    """Return the IoU after each view of orders, (starts, seeds, T)."""
    return np.array([[judged(watched, order) for order in seeds] for seeds in orders])


def _order(name: str, watched: WatchedObject, start: int, seed: Sequence[int], entrant: Entrant,
           episodes: Episodes, offsets: Offsets | None) -> Order:
    if name in _WORTH:
        return chosen_ahead(_WORTH[name], watched, start, episodes.count)
    if name == TOGETHER:
        return chosen_together(watched, start, episodes.count)
    plain, motion_cost = _parted(name)
    with naming(name):
        return chosen_by(_policy(plain, seed, entrant, episodes, offsets), watched, start,
                         episodes.count, motion_cost)


def _parted(name: str) -> tuple[str, float]:
    """Return the policy of a name NAME@COST and its cost of motion, 0 where none is named."""
    plain, named, cost = name.partition('@')
    try:
        motion_cost = float(cost) if named else 0.0
    except ValueError:
        motion_cost = math.nan
    if not 0 <= motion_cost < math.inf:
        raise ConfigError('policies: no cost of motion: expected NAME@COST such as '
                          f'attention@0.002, 0 or more, got {name!r}')
    return plain, motion_cost


def _policy(name: str, seed: Sequence[int], entrant: Entrant, episodes: Episodes,
            offsets: Offsets | None) -> Policy:
    if name != SEQUENCE:
        looks_elsewhere = name in (SWAPPED, SWAPPED_TURNED)
        return load_policy(_LOOKS_ELSEWHERE if looks_elsewhere else name, PolicyOptions(
            np.random.default_rng(seed), episodes.count, entrant.path))
    if offsets is None:
        raise ConfigError('sequence: none was found: expected training objects to find one on')
    return FixedSequence(offsets)


def _seeds(name: str, episodes: Episodes) -> int:
    plain, _ = _parted(name)
    return episodes.seeds if plain in POLICIES and POLICIES[plain].draws else 1


def _starts(scene: Scene, episodes: Episodes, row: int) -> list[int]:
    drawn = np.random.default_rng([episodes.seed, row]).permutation(scene.view_count)
    return [int(view) for view in drawn[:episodes.starts]]


def _watched(scene: Scene, entrant: Entrant, episodes: Episodes, row: int,
             rendering: int | None, turn: np.random.Generator | None = None) -> WatchedObject:
    """Return one object of a set under a rendering, None: as it was; `turn` draws its yaw."""
    views = some_objects(shown_views(scene, entrant), torch.tensor([row]))
    if turn is not None:
        views = turned(views, turn)
    if rendering is not None:
        views = another_rendering(views, 100_000 * rendering + row)
    side = max(side for side in entrant.sides if side in scene.truths)
    return WatchedObject(entrant.network, views, scene.truths[side][row],
                         entrant.thresholds[side], episodes.bfloat16)
