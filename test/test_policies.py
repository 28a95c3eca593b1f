"""View policies: where each of them goes, and what it says the others are worth."""

import math

from active_recon.acquisition.goal_places import goal_places
from active_recon.acquisition.motion import MotionLimits
from active_recon.errors import ConfigError, ViewError, WeightsError
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, nearest_view, orbit_camera
from active_recon.geometry.view_distance import direction_distance, pose_directions
from active_recon.models.weights import Bundle, save_weights
from active_recon.policies import load_policy, Observation, POLICIES, PolicyOptions
from active_recon.policies.attention import AttentionPolicy, enforce_separation, gaps_to_taken
from active_recon.policies.base import distance_to_taken
from active_recon.policies.geometric import FarthestPolicy, RandomPolicy, UniformPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
import numpy as np
import pytest

STEP = math.tau / 24


@pytest.fixture
def latent(tiny):
    return np.random.default_rng(0).normal(size=(3, 4 * tiny.latent_channels, 4, 4)).astype(
        np.float32)


def poses(azimuths, elevation=0.5):
    """Return cameras' poses, azimuths (B, t) to (B, t, 4, 4)."""
    return np.array([[orbit_camera(azimuth, elevation).pose for azimuth in row]
                     for row in np.asarray(azimuths, np.float64)])


RING = poses([AZIMUTHS])


def observed(latent, taken):
    """Return what was seen after views from azimuths, (B, t), with the ring to choose from."""
    return Observation(latent, poses(taken), RING)


def choose(policy, latent, taken, state=None):
    return policy.choose(observed(latent, taken),
                         policy.initial_state(len(taken)) if state is None else state)


def chosen(choice):
    """Return the azimuths (B,) that a choice leads to: those proposed, else the best ones."""
    best = AZIMUTHS[choice.scores.argmax(axis=1)]
    return best if choice.azimuth is None else np.where(
        np.isnan(choice.azimuth), best, choice.azimuth)


def episode(policy, start, count, latent):
    """Return the azimuths of an episode of `count` views, every goal reached exactly."""
    taken, state = np.array([[start]]), policy.initial_state(1)
    while taken.shape[1] < count:
        choice, state = choose(policy, latent[:1], taken, state)
        taken = np.column_stack([taken, chosen(choice)])
    return taken[0]


def made_of(attention, **settings):
    return AttentionPolicy(TorchPolicyRuntime(attention), **settings)


def all_policies(attention):
    return [RandomPolicy(np.random.default_rng(0)), UniformPolicy(5), FarthestPolicy(),
            made_of(attention)]


@pytest.mark.parametrize('index', range(4), ids=['random', 'uniform', 'farthest', 'attention'])
def test_the_choice_is_the_candidate_worth_most(attention, latent, index):
    policy = all_policies(attention)[index]
    taken = np.array([[0.0, 1.0], [AZIMUTHS[5], AZIMUTHS[20]], [6.2, 3.3]])
    choice, _ = choose(policy, latent, taken)
    goes_to = chosen(choice)
    assert goes_to.shape == (3,)
    assert choice.scores.shape == (3, 24)
    assert np.isfinite(choice.scores).all()
    assert ((goes_to >= 0) & (goes_to < math.tau)).all()
    np.testing.assert_array_equal(choice.scores.argmax(axis=1),
                                  [nearest_view(azimuth) for azimuth in goes_to])


@pytest.mark.parametrize('start', [0.0, AZIMUTHS[7], 0.1])
def test_random_takes_every_view_once_before_any_twice(latent, start):
    taken = episode(RandomPolicy(np.random.default_rng(3)), start, 24, latent)
    assert sorted(nearest_view(azimuth) for azimuth in taken) == list(range(24))


def test_random_goes_on_when_every_view_was_taken(latent):
    taken = episode(RandomPolicy(np.random.default_rng(3)), 0.0, 30, latent)
    assert len(taken) == 30


def test_random_takes_all_that_are_left_alike_and_repeats_with_its_seed(latent):
    taken = np.tile([[0.0, AZIMUTHS[1]]], (4400, 1))
    draws = [chosen(choose(RandomPolicy(np.random.default_rng(seed)), latent, taken)[0])
             for seed in (1, 1, 2)]
    counts = np.bincount([nearest_view(azimuth) for azimuth in draws[0]], minlength=24)
    assert not counts[:2].any()
    assert abs(counts[2:] - 200).max() < 5 * math.sqrt(200)  # five sigma
    np.testing.assert_array_equal(draws[0], draws[1])
    assert (draws[0] != draws[2]).any()


@pytest.mark.parametrize('count', [1, 2, 5, 8, 24])
def test_uniform_for_n_views_divides_the_turn_into_n(latent, count):
    taken = np.sort(episode(UniformPolicy(count), 1.3, count, latent))
    gaps = np.diff(np.append(taken, taken[0] + math.tau))
    np.testing.assert_allclose(gaps, math.tau / count, atol=1e-9)


def test_the_first_of_many_views_of_uniform_are_spread_over_the_turn(latent):
    first = np.sort(episode(UniformPolicy(100), 1.3, 8, latent))
    assert np.diff(np.append(first, first[0] + math.tau)).max() < 1.7 * math.tau / 8


def test_uniform_for_views_without_a_limit_needs_no_room_for_them(latent):
    first = np.sort(episode(UniformPolicy(10 ** 15), 1.3, 8, latent))
    assert np.diff(np.append(first, first[0] + math.tau)).max() < 1.7 * math.tau / 8


def test_uniform_keeps_to_its_sweep_however_roughly_it_is_followed(latent):
    choice, _ = choose(UniformPolicy(4), latent[:1], np.array([[1.0, 2.9, 3.9]]))
    assert choice.azimuth[0] == pytest.approx(1.0 + 3 * math.pi / 2)


def dome(low, high, limits=None):
    """Return the poses of a planner's candidates between two elevations, (K, 4, 4)."""
    places = goal_places(limits or MotionLimits(), elevation_range=(low, high))
    return np.stack([camera.pose for camera in places.candidates(orbit_camera(0.0))])


def on_dome(policy, candidates, start, count, latent):
    """Return the poses of an episode over candidates, (count, 4, 4)."""
    taken = [candidates[start]]
    while len(taken) < count:
        choice, _ = policy.choose(
            Observation(latent[:1], np.stack(taken)[None], candidates[None]), {})
        assert choice.azimuth is None or np.isnan(choice.azimuth).all()
        taken.append(candidates[choice.scores[0].argmax()])
    return np.stack(taken)


def uncovered(candidates, taken):
    """Return how far candidates are from the nearest view, radians, on average."""
    return direction_distance(pose_directions(candidates)[:, None],
                              pose_directions(taken)).min(axis=1).mean()


@pytest.mark.parametrize('count', [3, 5, 8])
@pytest.mark.parametrize('ends', [(0.0, 1.2), (0.2, 1.2), (-0.5, 1.0)])
def test_uniform_covers_a_dome_better_than_its_own_height_alone_and_than_chance(
        latent, ends, count):
    candidates = dome(*ends)
    rng = np.random.default_rng(0)
    swept, level, drawn = [], [], []
    for start in range(0, len(candidates), 5):
        swept.append(uncovered(candidates, on_dome(
            UniformPolicy(count), candidates, start, count, latent)))
        drawn.append(uncovered(candidates, on_dome(
            RandomPolicy(rng), candidates, start, count, latent)))
        x, y, z = pose_directions(candidates[start])
        level.append(uncovered(candidates, poses(
            [math.atan2(y, x) + np.arange(count) * math.tau / count], math.asin(z))[0]))
    assert np.mean(swept) < min(np.mean(level), np.mean(drawn))


@pytest.mark.parametrize('ends', [(0.0, 1.2), (-0.5, 1.0)])
def test_the_first_views_of_a_long_sweep_of_a_dome_are_spread_too(latent, ends):
    candidates, rng = dome(*ends), np.random.default_rng(0)
    episodes = [[on_dome(policy, candidates, start, 8, latent)
                 for start in range(0, len(candidates), 5)]
                for policy in (UniformPolicy(8), RandomPolicy(rng))]
    for views in range(2, 9):
        swept, drawn = (np.mean([uncovered(candidates, taken[:views]) for taken in each])
                        for each in episodes)
        assert swept < 0.95 * drawn


@pytest.mark.parametrize('count', [3, 5, 8])
def test_uniform_keeps_its_azimuths_on_a_dome_and_spreads_its_heights(latent, count):
    rng = np.random.default_rng(0)
    anywhere = np.stack([orbit_camera(*place).pose for place in zip(
        rng.uniform(0, math.tau, 3000), np.arcsin(rng.uniform(-0.99, 0.99, 3000)), strict=True)])
    taken = pose_directions(on_dome(UniformPolicy(count), anywhere, 45, count, latent))
    across = np.hypot(taken[:, 0], taken[:, 1])
    turned = np.arctan2(taken[:, 1], taken[:, 0]) - np.arctan2(taken[0, 1], taken[0, 0])
    steps = np.rint(turned * count / math.tau)
    assert sorted(steps % count) == list(range(count))
    assert (np.abs(turned - steps * math.tau / count) * across < math.radians(5)).all()
    gaps = np.diff(np.sort(taken[:, 2]))
    assert gaps.min() > 0.3 * 2 / count


@pytest.mark.parametrize('policy', [UniformPolicy(5), FarthestPolicy()])
def test_elevations_that_hardly_differ_are_those_of_a_turntable(latent, policy):
    rng = np.random.default_rng(1)
    for _ in range(10):
        taken = poses([rng.uniform(0, 6, 3)], 0.45)
        level = policy.choose(Observation(latent[:1], taken, poses([AZIMUTHS], 0.45)), {})[0]
        shaken = np.stack([orbit_camera(azimuth, 0.45 + away).pose for azimuth, away in zip(
            AZIMUTHS, rng.uniform(-0.08, 0.08, 24), strict=True)])[None]
        other = policy.choose(Observation(latent[:1], taken, shaken), {})[0]
        np.testing.assert_array_equal(other.azimuth, level.azimuth)


@pytest.mark.parametrize('start', AZIMUTHS)
def test_farthest_goes_opposite_first_then_halves_the_largest_gap(latent, start):
    taken = episode(FarthestPolicy(), start, 4, latent)
    assert abs(azimuth_difference(taken[1], start)) == pytest.approx(math.pi)
    gaps = np.diff(np.sort(azimuth_difference(taken, start) % math.tau))
    np.testing.assert_allclose(gaps, math.pi / 2, atol=1e-6)


def test_farthest_settles_ties_alike_for_azimuths_of_single_precision(latent):
    for start in range(24):
        exact = episode(FarthestPolicy(), AZIMUTHS[start], 12, latent)
        taken = np.float32(exact)
        for count in range(1, 12):
            choice, _ = choose(FarthestPolicy(), latent[:1], taken[None, :count].astype(float))
            assert chosen(choice)[0] == exact[count]


def test_the_distance_to_the_nearest_view_is_the_short_way(latent):
    taken, ring = [[AZIMUTHS[23], AZIMUTHS[2]]], [AZIMUTHS]
    horizon = Observation(latent, poses(taken, 0.0), poses(ring, 0.0))
    distances = distance_to_taken(horizon)[0]
    np.testing.assert_allclose(distances[[23, 0, 1, 2, 12]] / STEP, [0, 1, 1, 0, 10], atol=1e-9)


def test_the_distance_to_a_view_above_is_how_far_above_it_is(latent):
    above = Observation(latent, poses([[1.0]], 0.9), poses([[1.0, 1.0, 1.0]], 0.2))
    np.testing.assert_allclose(distance_to_taken(above), [[0.7] * 3], atol=1e-9)


def test_attention_takes_the_mean_of_its_model_and_carries_its_memory(attention, latent):
    import torch
    policy = made_of(attention)
    taken = np.array([[0.5], [1.5], [2.5]])
    choice, state = choose(policy, latent, taken)
    with torch.no_grad():
        proposal, expected = attention(torch.from_numpy(latent), torch.tensor([0.5, 1.5, 2.5]),
                                       attention.initial_state(3))
    np.testing.assert_allclose(
        azimuth_difference(choice.azimuth, proposal.mean_azimuth.numpy()), 0, atol=1e-6)
    assert state.keys() == expected.keys()
    for name, part in expected.items():
        np.testing.assert_allclose(state[name], part, atol=1e-6)
    with_memory, _ = choose(policy, latent, taken, state)
    assert np.abs(azimuth_difference(with_memory.azimuth, choice.azimuth)).max() > 1e-5


def test_attention_leaves_what_it_is_shown_as_it_is(attention, latent):
    latent.setflags(write=False)
    choose(made_of(attention), latent, np.zeros((3, 1)))


def test_attention_scores_an_azimuth_by_its_log_density(attention, latent):
    choice, _ = choose(made_of(attention, sigma=0.5), latent, np.zeros((3, 1)))
    away = azimuth_difference(AZIMUTHS, choice.azimuth[:, None])
    np.testing.assert_allclose(choice.scores, -(away / 0.5) ** 2 / 2, atol=1e-4)


def apart(azimuths, others):
    """Return how far each azimuth (B,) is from the nearest of others (B, t)."""
    return np.abs(azimuth_difference(others, azimuths[:, None])).min(axis=1)


@pytest.fixture
def draws():
    rng = np.random.default_rng(4)
    return rng.uniform(0, math.tau, 500), rng.uniform(0, math.tau, (500, 3))


def test_what_is_far_enough_is_left_where_it_is_wanted(draws):
    wanted, taken = draws
    np.testing.assert_array_equal(enforce_separation(wanted, taken, AZIMUTHS[None], 0.0), wanted)
    far_enough = apart(wanted, taken) >= 0.5
    assert 0 < far_enough.sum() < len(wanted)
    np.testing.assert_array_equal(
        enforce_separation(wanted, taken, AZIMUTHS[None], 0.5)[far_enough], wanted[far_enough])


def test_what_is_too_near_gives_way_to_the_nearest_that_is_not(draws):
    wanted, taken = draws
    kept = enforce_separation(wanted, taken, AZIMUTHS[None], 0.5)
    assert (apart(kept, taken) > 0.5 - 2e-3).all()
    moved = kept != wanted
    enough = np.where(gaps_to_taken(AZIMUTHS[None], taken) > 0.502, AZIMUTHS, np.nan)
    nearest = np.nanmin(np.abs(azimuth_difference(enough, wanted[:, None])), axis=1)
    assert (np.abs(azimuth_difference(kept, wanted))[moved] <= nearest[moved] + 1e-9).all()


def test_where_nothing_is_far_enough_the_farthest_is_taken():
    taken = np.delete(AZIMUTHS, [6, 7, 8])[None]
    np.testing.assert_array_equal(
        enforce_separation(np.array([0.1]), taken, AZIMUTHS[None], 1.0), AZIMUTHS[[7]])


def kept_policy(attention, separation):
    attention.view_separation = separation
    return made_of(attention)


def test_attention_that_keeps_apart_takes_every_view_once_before_any_twice(attention, latent):
    taken = episode(kept_policy(attention, math.radians(45)), 0.0, 25, latent)
    assert (apart(taken[1:8], np.tile(taken[:1], (7, 1))) > math.radians(45) - 2e-3).all()
    assert sorted(nearest_view(azimuth) for azimuth in taken[:24]) == list(range(24))


def test_what_is_too_near_to_a_view_is_worth_less_than_all_else(attention, latent):
    taken = np.array([[0.0, 1.0], [AZIMUTHS[5], AZIMUTHS[20]], [6.2, 3.3]])
    choice, _ = choose(kept_policy(attention, 0.7), latent, taken)
    near = gaps_to_taken(AZIMUTHS[None], taken) < 0.699
    for scores, here in zip(choice.scores, near, strict=True):
        assert scores[here].max() < scores[~here].min()
    np.testing.assert_array_equal(choice.scores.argmax(axis=1),
                                  [nearest_view(azimuth) for azimuth in chosen(choice)])


@pytest.mark.parametrize('shape', [(1, 3, 4, 4), (1, 8, 5, 4), (1, 8, 4)])
def test_a_latent_of_another_model_is_refused(attention, shape):
    with pytest.raises(ViewError, match=r'wrong shape of the latent: expected \(8, 4, 4\).*got'):
        choose(made_of(attention), np.zeros(shape, np.float32), np.zeros((1, 1)))


def test_policies_are_loaded_by_name(tmp_path, network, attention, tiny):
    path = tmp_path / 'weights.safetensors'
    save_weights(path, Bundle(network, attention, tiny, 0.4))
    kinds = [type(load_policy(name, PolicyOptions(weights=path))).__name__ for name in POLICIES]
    assert kinds == ['AttentionPolicy', 'RandomPolicy', 'UniformPolicy', 'FarthestPolicy',
                     *['RenderedPolicy'] * 3]
    with pytest.raises(ConfigError, match="'greedy': expected one of auto, attention, random"):
        load_policy('greedy')
    with pytest.raises(WeightsError, match='no such file'):
        load_policy('attention', PolicyOptions(weights=tmp_path / 'nothing.safetensors'))
