"""What a view scorer promises, whatever it has learned."""

from dataclasses import replace
import math

from active_recon.errors import ConfigError, WeightsError
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models import candidate_looks
from active_recon.models.candidate_looks import candidate_grids, look
from active_recon.models.scorer_weights import load_scorer, save_scorer
from active_recon.models.sight import cells_in_sight
from active_recon.models.view_scorer import Looked, ScorerConfig, ViewScorer
from active_recon.models.weights_files import scorer_path, weights_hash
from active_recon.policies import Observation
from active_recon.policies.candidate_rendering import (
    coarse_volume,
    CoarseVolume,
    in_sight,
)
from active_recon.policies.scoring import ScoringPolicy
from active_recon.runtimes.torch import TorchPolicyRuntime
from faded_volumes import some_volume
import numpy as np
import pytest
import torch
from torch.testing import assert_close

SIDE = 16
SMALL = ScorerConfig(hidden=16, members=2)
LATENT = np.zeros((1, 1, 4, 4), np.float32)


@pytest.fixture
def scorer():
    torch.manual_seed(0)
    return ViewScorer.from_config(SMALL).eval()


def poses(azimuths, elevation=0.5, distance=2.1):
    """Return cameras' poses, (1, K, 4, 4); elevations one for all or one each."""
    elevations = np.broadcast_to(elevation, len(azimuths))
    return np.array([[orbit_camera(azimuth, height, distance).pose
                      for azimuth, height in zip(azimuths, elevations, strict=True)]])


def observed(volumes, taken, candidates):
    return Observation(np.repeat(LATENT[:, 0], len(volumes), 0)[:, None], taken, candidates,
                       volumes)


def scored(scorer, seen):
    policy = ScoringPolicy(TorchPolicyRuntime(scorer))
    choice = policy.choose(seen, policy.initial_state(len(seen.taken)))[0]
    assert choice.is_gain
    return choice.scores


def turned(array, quarters):
    return np.ascontiguousarray(np.rot90(array, quarters, (1, 2)))


def test_permuted_candidates_have_permuted_scores(scorer):
    order = np.random.default_rng(0).permutation(24)
    ring, taken = poses(AZIMUTHS), poses([0.1, 2.0])
    here = scored(scorer, observed(some_volume()[None], taken, ring))
    there = scored(scorer, observed(some_volume()[None], taken, ring[:, order]))
    np.testing.assert_allclose(there, here[:, order], atol=1e-6)
    assert np.ptp(here) > 1e-3


@pytest.mark.parametrize('quarters', [1, 2, 3])
def test_a_quarter_turn_of_object_and_cameras_changes_no_score(scorer, quarters):
    azimuths, heights = AZIMUTHS + 0.07, np.linspace(-0.2, 1.3, 24)
    away = quarters * math.pi / 2
    volume = some_volume()[None]
    here = scored(scorer, observed(volume, poses([0.3, 1.9]), poses(azimuths, heights)))
    there = scored(scorer, observed(turned(volume, quarters), poses([0.3 + away, 1.9 + away]),
                                    poses(azimuths + away, heights)))
    # Samples on the border of two cells may round to either
    np.testing.assert_allclose(there, here, atol=0.02 * np.ptp(here))


def test_mirrored_objects_and_cameras_have_the_same_scores(scorer):
    azimuths, heights = AZIMUTHS + 0.07, np.linspace(-0.2, 1.3, 24)
    volume = some_volume()[None]
    here = scored(scorer, observed(volume, poses([0.3, 1.9]), poses(azimuths, heights)))
    there = scored(scorer, observed(volume[:, :, ::-1], poses([-0.3, -1.9]),
                                    poses(-azimuths, heights)))
    # Samples on the border of two cells may round to either
    np.testing.assert_allclose(there, here, atol=0.02 * np.ptp(here))
    assert np.ptp(here) > 1e-3


def test_objects_of_a_batch_are_scored_alone(scorer):
    volumes = np.stack([some_volume(seed) for seed in range(3)])
    taken = np.concatenate([poses([azimuth, azimuth + 1]) for azimuth in (0.1, 2.0, 4.0)])
    together = scored(scorer, observed(volumes, taken, poses(AZIMUTHS)))
    for row in range(3):
        alone = scored(scorer, observed(volumes[row:row + 1], taken[row:row + 1],
                                        poses(AZIMUTHS)))
        np.testing.assert_allclose(together[row], alone[0], atol=1e-6)


@pytest.mark.parametrize('count', [1, 2, 7, 200])
def test_any_number_of_candidates_anywhere_is_scored(scorer, count):
    rng = np.random.default_rng(count)
    ring = poses(rng.uniform(0, math.tau, count), rng.uniform(-1.5, 1.5, count), 1.4)
    scores = scored(scorer, observed(some_volume()[None], poses([0.2]), ring))
    assert scores.shape == (1, count) and np.isfinite(scores).all()


@pytest.mark.parametrize('offset', [-0.5, 0.5])
def test_a_view_that_was_taken_is_worth_nothing_and_comes_last(scorer, offset):
    scorer.calibration[:, 2] = offset  # all gains far below 0, or far above
    taken = [AZIMUTHS[4], AZIMUTHS[17]]
    scores = scored(scorer, observed(some_volume()[None], poses(taken), poses(AZIMUTHS)))[0]
    assert set(np.argsort(scores, kind='stable')[:2].tolist()) == {4, 17}
    assert scores[[4, 17]] == pytest.approx(min(scores.min(), 0), abs=1e-4)


@pytest.mark.parametrize('count', [1, 3, 9])
def test_any_number_of_views_may_have_been_taken(scorer, count):
    scores = scored(scorer, observed(some_volume()[None], poses(np.arange(count) * 0.6),
                                     poses(AZIMUTHS)))
    assert np.isfinite(scores).all()


def test_the_roll_of_a_camera_makes_no_difference(scorer):
    rolled = poses(AZIMUTHS)
    turn = np.eye(4)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    here, there = (scored(scorer, observed(some_volume()[None], poses([1.0]), candidates))
                   for candidates in (rolled, rolled @ turn))
    np.testing.assert_allclose(here, there, atol=1e-5)


def test_the_mean_score_is_the_level(scorer):
    scorer.calibration.copy_(torch.tensor([2.0, 3, 0.5]).expand_as(scorer.calibration))
    volume = coarse_volume(some_volume()[None])
    given = [torch.from_numpy(each) for each in look(
        volume.occupancy, volume.entropy, poses([0.4]), poses(AZIMUTHS))]
    scores, level = scorer.scores(Looked(given[0], given[1], given[2].long()))
    assert_close(scores.mean(dim=1), torch.zeros(1), atol=1e-5, rtol=0)
    gain = scorer(*given, state={})[0].gain
    assert_close(gain, 2 * scores + 3 * level[:, None] + 0.5)


def test_sampled_sight_is_near_to_the_exact_one():
    exact_volume = coarse_volume(some_volume()[None])
    taken = poses([0.4])
    exact = in_sight(exact_volume, taken)[0].ravel()
    found = cells_in_sight(taken[0, 0], exact_volume.occupancy[0], 24, 32)
    assert np.corrcoef(exact, found)[0, 1] > 0.9


def grids(volume, taken, candidates):
    return torch.from_numpy(candidate_grids(
        volume.occupancy[0], volume.entropy[0], taken[0], candidates[0]))


def test_an_empty_volume_shows_nothing_and_all_of_it_was_seen():
    nothing = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
    found = grids(CoarseVolume(nothing, nothing), poses([0.4]), poses(AZIMUTHS))
    assert_close(found, torch.zeros_like(found))


def test_what_lies_near_to_a_candidate_is_in_the_front_of_its_grid():
    cells = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
    cells[0, 12:, 6:10, 6:10] = 1  # towards +x
    volume = CoarseVolume(cells, cells * 0)
    front, back = grids(volume, poses([1.0]), poses([0, math.pi], 0.0))[:, 0]
    assert front[:4].sum() > 0 == front[4:].sum()
    assert back[4:].sum() > 0 == back[:4].sum()


def test_a_wall_leaves_only_what_is_behind_it_unseen():
    cells = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
    cells[0, 8, :, :] = 1
    unseen = grids(CoarseVolume(cells, cells * 0), poses([0], 0.0), poses([0], 0.0))[0, 2]
    assert unseen[5, 3:5, 3:5].min() > 0.9 and unseen[:3, 3:5, 3:5].max() < 0.1


def test_mirrored_objects_have_mirrored_grids():
    volume = coarse_volume(some_volume()[None])
    flipped = CoarseVolume(volume.occupancy[:, :, ::-1].copy(), volume.entropy[:, :, ::-1].copy())
    found = [grids(of, poses([sign * 0.4]), poses([sign * 1.3, sign * 2.9]))
             for of, sign in ((volume, 1), (flipped, -1))]
    apart = (found[0] - found[1].flip(-1)).abs().mean() / found[0].abs().mean()
    assert apart < 0.02


def test_weights_come_back_as_they_were(scorer, tmp_path):
    weights = tmp_path / 'net.safetensors'
    weights.write_bytes(b'of a network')
    path = scorer_path(weights)
    assert path.name == 'net-scorer.safetensors'
    save_scorer(path, scorer, SMALL, weights_hash(weights), {'data': 'some'})
    loaded = load_scorer(weights)
    for name, tensor in scorer.state_dict().items():
        assert_close(loaded.state_dict()[name], tensor, rtol=0, atol=0)
    assert path.with_suffix('.json').is_file()


def test_a_scorer_of_other_weights_is_refused_with_what_to_do(scorer, tmp_path):
    weights = tmp_path / 'net.safetensors'
    weights.write_bytes(b'of a network')
    with pytest.raises(WeightsError, match=r'no view policy.*train-policy'):
        load_scorer(weights)
    save_scorer(scorer_path(weights), scorer, SMALL, 'f' * 64, {})
    with pytest.raises(WeightsError, match=r'other weights: expected .*got one for ffffffffffff'
                                           r'.*train-policy') as refused:
        load_scorer(weights)
    assert '\n' not in str(refused.value)
    scorer_path(weights).write_bytes(b'broken')
    with pytest.raises(WeightsError, match='no whole safetensors'):
        load_scorer(weights)


def test_a_scorer_with_numbers_that_are_not_finite_is_refused(tmp_path):
    weights = tmp_path / 'net.safetensors'
    weights.write_bytes(b'of a network')
    spoilt = ViewScorer.from_config(SMALL)
    torch.nn.init.constant_(spoilt.members[0].all.bias, torch.nan)
    save_scorer(scorer_path(weights), spoilt, SMALL, weights_hash(weights), {})
    with pytest.raises(WeightsError, match=r'finite numbers in members\.0\.all\.bias'):
        load_scorer(weights)


def test_lines_of_sight_that_were_kept_show_the_same():
    volume, taken = coarse_volume(some_volume()[None]), poses([0.4, 2.0])
    sets = [poses(AZIMUTHS), poses(AZIMUTHS + 0.1), poses(AZIMUTHS, 0.9)]
    first = [grids(volume, taken, candidates) for candidates in sets]
    for candidates, found in zip(sets, first, strict=True):
        assert_close(grids(volume, taken, candidates), found, rtol=0, atol=0)
    candidate_looks._means.cache_clear()
    assert_close(grids(volume, taken, sets[1]), first[1], rtol=0, atol=0)
    assert (first[0] - first[1]).abs().max() > 1e-3


def test_sizes_that_make_no_network_are_refused():
    with pytest.raises(ConfigError, match='invalid sizes: expected 1 or more.*got 4, 0'):
        replace(ScorerConfig(), hidden=0)
    with pytest.raises(ConfigError, match='invalid patches: expected a divisor of 8, got 3'):
        replace(ScorerConfig(), patches=3)
