"""Policies that look at the probabilities: where doubt is in sight, and where it is hidden."""

import math

from active_recon.acquisition.motion import MotionLimits
from active_recon.errors import ViewError
from active_recon.geometry.cameras import AZIMUTHS, nearest_view, orbit_camera
from active_recon.planner import Planner
from active_recon.policies import load_policy, Observation, POLICIES
from active_recon.policies.base import distance_to_taken
from active_recon.policies.candidate_rendering import coarse_volume
from active_recon.policies.rendered import unseen_entropy, visible_entropy
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest

NAMES = [name for name, entry in POLICIES.items() if entry.looks]
SIDE = 32
LATENT = np.zeros((1, 4, 4), np.float32)


def poses(azimuths, elevation=0.5):
    return np.array([[orbit_camera(azimuth, elevation).pose for azimuth in azimuths]])


def block_with_a_doubtful_side(quarters=0):
    """Return an opaque block whose side towards +x is doubtful, turned by quarters about +z."""
    cells = np.zeros((SIDE,) * 3, np.float32)
    cells[8:20, 10:22, 8:24] = 1
    cells[20:24, 10:22, 8:24] = 0.5
    return np.ascontiguousarray(np.rot90(cells, quarters, (0, 1)))


def choice(name, volumes, taken):
    seen = Observation(LATENT[None], taken, poses(AZIMUTHS), volumes)
    policy = load_policy(name)
    return policy.choose(seen, policy.initial_state(len(volumes)))[0]


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('quarters', range(4))
def test_the_doubtful_side_is_looked_at_wherever_it_is(name, quarters):
    behind = [(2 + quarters) * math.pi / 2]
    found = choice(name, block_with_a_doubtful_side(quarters)[None], poses(behind))
    away = AZIMUTHS[found.scores[0].argmax()] - quarters * math.pi / 2
    assert abs((away + math.pi) % math.tau - math.pi) <= math.radians(60) + 1e-6
    assert found.azimuth is None
    scores = np.roll(found.scores[0], -6 * quarters)
    assert scores[[23, 0, 1]].min() > scores[[10, 11, 13, 14]].max()


@pytest.mark.parametrize('name', NAMES)
def test_a_view_that_was_taken_comes_after_all_others(name):
    volume = np.random.default_rng(0).random((1, SIDE, SIDE, SIDE)).astype(np.float32)
    taken = [AZIMUTHS[4] + 0.02, AZIMUTHS[17]]
    scores = choice(name, volume, poses(taken)).scores[0]
    assert set(np.argsort(scores)[:2].tolist()) == {4, 17}
    assert np.isfinite(scores).all() and scores.shape == (24,)


@pytest.mark.parametrize('name', NAMES)
def test_objects_of_a_batch_are_judged_alone(name):
    volumes = np.stack([block_with_a_doubtful_side(quarters) for quarters in range(3)])
    taken = np.concatenate([poses([azimuth]) for azimuth in (0.1, 2.0, 4.0)])
    together = choice(name, volumes, taken).scores
    for row in range(3):
        alone = choice(name, volumes[row:row + 1], taken[row:row + 1]).scores
        np.testing.assert_allclose(together[row], alone[0], rtol=1e-6)


def test_what_a_view_had_in_sight_is_not_looked_for_again():
    cells = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
    cells[0, 14:18, 4:28, 4:28] = 1  # a wall, doubtful on both of its sides
    cells[0, 12:14, 4:28, 4:28] = cells[0, 18:20, 4:28, 4:28] = 0.5
    front, back = nearest_view(0.0), nearest_view(math.pi)
    for seen_from, other in ((front, back), (back, front)):
        seen = Observation(LATENT[None], poses([AZIMUTHS[seen_from]]), poses(AZIMUTHS), cells)
        unseen, visible = (worth(seen, coarse_volume(cells))[0]
                           for worth in (unseen_entropy, visible_entropy))
        near, opposite = (seen_from + 2) % 24, (other + 2) % 24
        assert unseen[opposite] > 3 * unseen[near]
        assert visible[opposite] == pytest.approx(visible[near], rel=0.05)


@pytest.mark.parametrize('name', NAMES)
def test_goals_keep_away_from_views_taken_as_long_as_they_can(name):
    volume = block_with_a_doubtful_side()[None]
    taken = [math.pi]
    for _ in range(6):
        scores = choice(name, volume, poses(taken)).scores[0]
        goal = AZIMUTHS[scores.argmax()]
        away = distance_to_taken(Observation(LATENT[None], poses(taken), poses([goal])))
        farthest = distance_to_taken(
            Observation(LATENT[None], poses(taken), poses(AZIMUTHS))).max()
        assert away[0, 0] >= min(math.radians(60), 0.75 * farthest) - 1e-3
        taken.append(goal)


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('half', [math.radians(30), math.radians(45)])
def test_goals_keep_apart_within_the_azimuths_that_the_camera_can_reach(name, half):
    planner = Planner.load(name, max_views=4, entropy_tolerance=0.0,
                           limits=MotionLimits((-half, half)))
    camera, taken = orbit_camera(-half, 0.5), []
    while camera is not None:
        taken.append(camera.azimuth)
        goal = planner.add_view(
            LATENT, camera, 10.0, VoxelGrid(block_with_a_doubtful_side(), 1.0)).goal
        camera = goal and goal.camera
        if goal:
            away = distance_to_taken(Observation(LATENT[None], poses(taken), poses(
                [each.azimuth for each in (camera, *goal.candidates)])))[0]
            assert away[0] >= 0.75 * away.max() - 1e-3
    assert len(taken) == 4


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('size', [0.05, 1.0, 8.0])
def test_the_metre_makes_no_difference_to_the_planner(name, size):
    planner = Planner.load(name, entropy_tolerance=0, distance=2.1 * size)
    camera = planner.first_goal(orbit_camera(math.pi)).camera
    decision = planner.add_view(LATENT, camera, 1.0,
                                VoxelGrid(block_with_a_doubtful_side(), size))
    unit = Planner.load(name, entropy_tolerance=0, distance=2.1)
    unit.first_goal(orbit_camera(math.pi))
    expected = unit.add_view(LATENT, orbit_camera(math.pi), 1.0,
                             VoxelGrid(block_with_a_doubtful_side(), 1.0))
    np.testing.assert_allclose(decision.goal.scores, expected.goal.scores, rtol=1e-3)
    assert decision.goal.camera.distance == pytest.approx(2.1 * size)


@pytest.mark.parametrize('name', NAMES)
def test_without_probabilities_the_planner_refuses_the_view(name):
    planner = Planner.load(name)
    planner.first_goal(orbit_camera(0.0))
    with pytest.raises(ViewError, match='no probabilities'):
        planner.add_view(LATENT, orbit_camera(0.0), 1.0)
