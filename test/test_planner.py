"""The planner: where next, when it is enough, and in whose frame."""

import math

from active_recon.cameras import azimuth_difference, AZIMUTHS
from active_recon.errors import ConfigError, ViewError
from active_recon.planner import Planner
from active_recon.policies.attention import AttentionPolicy
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
import numpy as np
import pytest

LATENT = np.random.default_rng(0).normal(size=(8, 4, 4)).astype(np.float32)


def views_until_done(planner, entropies):
    """Follow every goal; return the number of views taken and the reason for the end."""
    azimuth = planner.first_goal(0.0).azimuth
    for count, entropy in enumerate(entropies, 1):
        decision = planner.add_view(LATENT, azimuth, entropy)
        if decision.goal is None:
            return count, decision.reason
        azimuth = decision.goal.azimuth
    return len(entropies), ''


@pytest.mark.parametrize('most', [1, 2, 5])
def test_it_stops_after_max_views(most):
    planner = Planner(FarthestPolicy(), max_views=most)
    assert views_until_done(planner, [100, 10, 1000, 1, 50]) == (most, 'max_views')


def test_it_stops_when_the_entropy_has_settled_over_two_views():
    planner = Planner(FarthestPolicy(), max_views=24, entropy_tolerance=0.01)
    assert views_until_done(planner, [100, 99.5, 90, 89.5, 89.2]) == (5, 'entropy_settled')


@pytest.mark.parametrize('entropies', [[100, 100], [100, 98, 100, 98, 100], [1, 1.1, 1.2, 1.3]])
def test_an_entropy_that_still_changes_has_not_settled(entropies):
    planner = Planner(FarthestPolicy(), max_views=24, entropy_tolerance=0.01)
    assert views_until_done(planner, entropies) == (len(entropies), '')


def test_an_entropy_of_nothing_left_has_settled():
    assert views_until_done(Planner(FarthestPolicy(), 24), [0.0] * 5) == (3, 'entropy_settled')


def test_a_tolerance_of_zero_never_settles():
    planner = Planner(FarthestPolicy(), max_views=6, entropy_tolerance=0)
    assert views_until_done(planner, [5.0] * 6) == (6, 'max_views')


def test_the_first_view_is_where_it_is_asked_for():
    goal = Planner(FarthestPolicy()).first_goal(-1.0)
    assert goal.azimuth == pytest.approx(math.tau - 1.0)
    assert abs(azimuth_difference(goal.candidates[goal.scores.argmax()], -1.0)) < math.pi / 24


def test_a_plan_repeats_the_goal_also_when_the_episode_is_done():
    planner = Planner(FarthestPolicy(), max_views=2)
    first = planner.first_goal(0.3)
    assert planner.plan() is first
    second = planner.add_view(LATENT, 0.3, 10).goal
    assert planner.plan() is second
    assert planner.plan() is second
    assert planner.add_view(LATENT, second.azimuth, 9).goal is None
    after = planner.plan()
    assert after is planner.plan()
    assert abs(azimuth_difference(after.azimuth, second.azimuth)) > 1


def test_there_is_no_plan_before_the_first_view_nor_after_a_reset():
    planner = Planner(FarthestPolicy())
    with pytest.raises(ViewError, match='expected a view before a plan'):
        planner.plan()
    planner.first_goal(0.0)
    planner.reset()
    with pytest.raises(ViewError, match='expected a view before a plan'):
        planner.plan()


def test_a_reset_planner_is_as_good_as_new(attention):
    planner = Planner(AttentionPolicy(attention), max_views=4, entropy_tolerance=0)
    runs = []
    for _ in range(2):
        runs.append([planner.add_view(LATENT, azimuth, 10.0).reason or planner.plan().azimuth
                     for azimuth in (0.0, 2.0, 4.0, 1.0)])
        planner.reset()
    assert runs[0] == runs[1]
    assert runs[0][-1] == 'max_views'


@pytest.mark.parametrize('yaw', [0.3, math.pi / 2, -2.0, 6.0])
@pytest.mark.parametrize('kind', ['farthest', 'uniform', 'attention'])
def test_a_turned_object_turns_everything_with_it(attention, kind, yaw):
    def make(object_yaw):
        policy = {'farthest': FarthestPolicy(), 'uniform': UniformPolicy(5),
                  'attention': AttentionPolicy(attention)}[kind]
        return Planner(policy, object_yaw=object_yaw, entropy_tolerance=0)

    straight, turned = make(0.0), make(yaw)
    for azimuth in (AZIMUTHS[3], AZIMUTHS[9], AZIMUTHS[16]):
        goal = straight.add_view(LATENT, azimuth, 10.0).goal
        other = turned.add_view(LATENT, azimuth + yaw, 10.0).goal
        assert azimuth_difference(other.azimuth, goal.azimuth + yaw) == pytest.approx(0, abs=1e-5)
        np.testing.assert_allclose(
            azimuth_difference(other.candidates, goal.candidates + yaw), 0, atol=1e-9)
        np.testing.assert_allclose(other.scores, goal.scores, atol=1e-4)
        assert 0 <= other.azimuth < math.tau
        assert ((other.candidates >= 0) & (other.candidates < math.tau)).all()


@pytest.mark.parametrize('wrong', [
    (np.full_like(LATENT, math.nan), 1.0, 10.0), (LATENT, math.nan, 10.0),
    (LATENT, math.inf, 10.0), (LATENT, 1.0, math.nan), (LATENT[:3], 1.0, 10.0)],
    ids=['latent', 'azimuth', 'infinite azimuth', 'entropy', 'another latent'])
def test_a_view_that_is_refused_changes_nothing(attention, wrong):
    disturbed, undisturbed = (Planner(AttentionPolicy(attention), 3, 0) for _ in range(2))
    disturbed.add_view(LATENT, 0.0, 10.0)
    before = disturbed.plan()
    with pytest.raises(ViewError, match='expected a'):
        disturbed.add_view(*wrong)
    assert disturbed.plan() is before
    undisturbed.add_view(LATENT, 0.0, 10.0)
    assert (disturbed.add_view(LATENT, 1.0, 10.0).goal.azimuth
            == undisturbed.add_view(LATENT, 1.0, 10.0).goal.azimuth)


@pytest.mark.parametrize('azimuth', [math.nan, math.inf, -math.inf])
def test_a_first_azimuth_that_is_not_finite_is_refused(azimuth):
    with pytest.raises(ViewError, match='expected a finite azimuth, got'):
        Planner(FarthestPolicy()).first_goal(azimuth)


@pytest.mark.parametrize(('settings', 'message'), [
    ({'max_views': 0}, 'max_views: expected 1 or more, got 0'),
    ({'entropy_tolerance': 1.0}, r'entropy_tolerance: expected a share in \[0, 1\), got 1'),
    ({'entropy_tolerance': math.nan}, 'entropy_tolerance: .* got nan'),
    ({'object_yaw': math.inf}, 'object_yaw: expected finite radians, got inf'),
])
def test_settings_out_of_range_are_refused_with_the_range(settings, message):
    with pytest.raises(ConfigError, match=message):
        Planner(FarthestPolicy(), **settings)


def test_it_is_loaded_by_the_name_of_its_policy_and_repeats_with_its_seed():
    goals = [Planner.load('random', seed=seed).add_view(LATENT, 0.0, 1.0).goal.azimuth
             for seed in (1, 1, 2)]
    assert goals[0] == goals[1] != goals[2]
    with pytest.raises(ConfigError, match='policy: expected one of'):
        Planner.load('best')


def seen(planner, count):
    """Follow the planner's goals for so many views."""
    azimuth = planner.first_goal(1.0).azimuth
    for number in range(count):
        latent = np.random.default_rng(number).normal(size=LATENT.shape).astype(np.float32)
        azimuth = planner.add_view(latent, azimuth, 100.0 / (number + 1)).goal.azimuth
    return planner


@pytest.mark.parametrize('policy', [
    lambda: RandomPolicy(np.random.default_rng(3)), FarthestPolicy, lambda: UniformPolicy(7)])
def test_a_planner_goes_on_from_what_another_has_seen_as_if_it_had_been_there(policy):
    before = seen(Planner(UniformPolicy(5), max_views=9), 3)
    after = Planner(policy(), max_views=9)
    after.go_on_from(before)
    always = Planner(policy(), max_views=9)
    for number, azimuth in enumerate(before._taken):
        latent = np.random.default_rng(number).normal(size=LATENT.shape).astype(np.float32)
        always.add_view(latent, azimuth, 100.0 / (number + 1))
    assert after.plan().azimuth == always.plan().azimuth
    one, other = (each.add_view(LATENT, 2.0, 20.0) for each in (after, always))
    assert one.goal.azimuth == other.goal.azimuth


def test_a_planner_that_goes_on_with_the_same_policy_draws_nothing_anew():
    policy = RandomPolicy(np.random.default_rng(3))
    before = seen(Planner(policy, max_views=9), 2)
    goal = before.plan()
    after = Planner(policy, max_views=3)
    after.go_on_from(before)
    assert after.plan().azimuth == goal.azimuth
    assert after.add_view(LATENT, 2.0, 20.0).reason == 'max_views'


def test_a_first_goal_that_is_open_stays_the_plan_of_the_planner_that_goes_on():
    before = Planner(UniformPolicy(5))
    goal = before.first_goal(1.0)
    after = Planner(FarthestPolicy())
    after.go_on_from(before)
    assert after.plan().azimuth == goal.azimuth
