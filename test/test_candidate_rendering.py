"""What candidates would see of probabilities: exact where they are sure, and turning with them."""

import math

from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.policies.candidate_rendering import coarse_volume, in_sight, render_candidates
from active_recon.policies.sight_lines import cell_lines, image_lines
from faded_volumes import some_volume
import numpy as np
import pytest

SIDE = 16


def ring(elevation=0.5, azimuths=AZIMUTHS, distance=2.1):
    """Return poses of cameras around the object, (1, K, 4, 4)."""
    return np.array([[orbit_camera(azimuth, elevation, distance).pose for azimuth in azimuths]])


def rendered(occupancy, poses=None, taken=None):
    """Return what the ring sees of one volume (R, R, R)."""
    return render_candidates(coarse_volume(occupancy[None].astype(np.float32)),
                             ring() if poses is None else poses, taken)


def hits(poses, low, high, rays=16):
    """Return the distance at which lines of sight hit a box, (K, rays, rays), inf beside it."""
    found = []
    for pose in poses[0]:
        origin, distance = pose[:3, 3], np.linalg.norm(pose[:3, 3])
        tangent = math.sqrt(0.75 / (distance ** 2 - 0.75))
        across = ((np.arange(rays) + 0.5) / rays * 2 - 1) * tangent
        right, down, forward = pose[:3, :3].T
        towards = forward + across[:, None, None] * down + across[:, None] * right
        towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
        ends = np.sort([(low - origin) / towards, (high - origin) / towards], axis=0)
        enter, leave = ends[0].max(-1), ends[1].min(-1)
        found.append(np.where(leave > enter + 1e-5, enter, np.inf))
    return np.array(found)


def test_an_opaque_box_has_its_exact_depth_and_outline():
    cells = np.zeros((32,) * 3)
    cells[8:20, 12:24, 4:26] = 1  # whole coarse cells
    seen = rendered(cells)
    expected = hits(ring(), np.array([8, 12, 4]) / 32 - 0.5, np.array([20, 24, 26]) / 32 - 0.5)
    there = np.isfinite(expected)
    np.testing.assert_array_equal(seen.silhouette[0], there)
    np.testing.assert_allclose(seen.depth[0][there], expected[there], atol=1e-5)
    assert 0.05 < there.mean() < 0.5


@pytest.mark.parametrize('low', [(7, 13, 5), (9, 11, 4)])
def test_a_box_between_coarse_cells_is_seen_as_the_coarse_cells_that_hold_it(low):
    low, high = np.array(low), np.array([41, 47, 53])
    cells = np.zeros((64,) * 3)
    cells[tuple(map(slice, low, high))] = 1
    seen = rendered(cells)
    outer = hits(ring(), low // 4 / SIDE - 0.5, -(-high // 4) / SIDE - 0.5)
    there = np.isfinite(outer)
    np.testing.assert_array_equal(seen.silhouette[0], there)
    np.testing.assert_allclose(seen.depth[0][there], outer[there], atol=1e-5)


def test_nothing_is_seen_of_an_empty_volume():
    seen = rendered(np.zeros((32,) * 3), taken=ring(azimuths=[0.3]))
    for name in ('silhouette', 'depth', 'depth_variance', 'entropy', 'unseen'):
        assert not getattr(seen, name).any(), name


def test_what_is_sure_has_no_variance_of_depth_and_no_entropy():
    seen = rendered(np.random.default_rng(0).random((32,) * 3) < 0.1)
    assert not seen.depth_variance.any() and not seen.entropy.any()
    assert set(np.unique(seen.silhouette)) == {0, 1}


@pytest.mark.parametrize('quarters', [1, 2, 3])
def test_volume_and_cameras_turned_together_look_the_same(quarters):
    cells, taken = some_volume(), [0.2, 2.9]
    turn = quarters * math.pi / 2
    plain = rendered(cells, taken=ring(azimuths=taken))
    turned = rendered(np.rot90(cells, quarters, (0, 1)), ring(azimuths=AZIMUTHS + turn),
                      ring(azimuths=[azimuth + turn for azimuth in taken]))
    for name in ('silhouette', 'depth', 'depth_variance', 'entropy', 'unseen'):
        np.testing.assert_allclose(getattr(turned, name), getattr(plain, name), atol=2e-5,
                                   err_msg=name)
    assert np.ptp(plain.silhouette.mean(axis=(2, 3))) > 0.005  # it is not round


def test_a_denser_volume_never_lowers_the_silhouette():
    cells = some_volume()
    for share in (0.2, 0.9):
        denser = cells + share * (1 - cells) * (np.random.default_rng(1).random(cells.shape) < 0.3)
        assert (rendered(denser).silhouette >= rendered(cells).silhouette - 1e-6).all()


def test_two_doubtful_layers_are_seen_as_the_formulas_say():
    cells = np.zeros((SIDE,) * 3)
    cells[9], cells[10] = 0.25, 0.5  # the camera on +x meets the second first
    seen = rendered(cells, ring(0.0, [0.0]))
    first = 2.1 - (11 / SIDE - 0.5)
    middle = (0, 0, slice(7, 9), slice(7, 9))
    np.testing.assert_allclose(seen.silhouette[middle], 1 - 0.5 * 0.75, atol=1e-6)
    share = 0.5 * 0.25 / (1 - 0.5 * 0.75)
    np.testing.assert_allclose(seen.depth[middle], first + share / SIDE, rtol=2e-3)
    np.testing.assert_allclose(seen.depth_variance[middle], share * (1 - share) / SIDE ** 2,
                               rtol=2e-2)
    near, far = (-p * math.log(p) - (1 - p) * math.log(1 - p) for p in (0.5, 0.25))
    np.testing.assert_allclose(seen.entropy[middle], near + 0.5 * far, rtol=1e-5)


def test_what_is_behind_a_wall_is_neither_in_sight_nor_seen():
    cells = np.zeros((SIDE,) * 3)
    cells[8] = 1
    cells[3:6, 6:10, 6:10] = 0.5
    front, back = ring(0.0, [0.0]), ring(0.0, [math.pi])
    both = rendered(cells, np.concatenate([front, back], axis=1))
    assert both.entropy[0, 1].max() > 0 and both.entropy[0, 0, 4:12, 4:12].max() == 0
    volume = coarse_volume(cells[None].astype(np.float32))
    assert in_sight(volume, front)[0, 3:6, 6:10, 6:10].max() == 0
    assert in_sight(volume, np.concatenate([front, back], axis=1))[0, 3, 6:10, 6:10].min() == 1
    assert rendered(cells, back, front).unseen[0, 0].max() > 0
    # The layer nearest to the camera was in sight of it, and what stands behind it in part
    seen_before = rendered(cells, back, back).unseen.sum()
    assert 0 < seen_before < 0.6 * rendered(cells, back, front).unseen.sum()


def test_objects_and_candidates_of_a_batch_do_not_mix():
    cells = np.stack([some_volume(seed) * (1 - 0.4 * seed) for seed in range(2)])
    own = np.concatenate([ring(0.3), ring(0.9)])
    both = render_candidates(coarse_volume(cells), own, own[:, :3])
    for row in range(2):
        alone = render_candidates(coarse_volume(cells[row:row + 1]), own[row:row + 1, 5:7],
                                  own[row:row + 1, :3])
        for name in ('silhouette', 'depth', 'entropy', 'unseen'):
            np.testing.assert_array_equal(getattr(both, name)[row, 5:7], getattr(alone, name)[0])


def test_coarse_cells_hide_what_any_of_theirs_does_and_have_their_mean_entropy():
    fine = np.where(np.random.default_rng(0).random((2, 32, 32, 32)) < 0.2, np.float32(0.5), 0)
    coarse = coarse_volume(fine)
    blocks = fine.reshape(2, SIDE, 2, SIDE, 2, SIDE, 2)
    np.testing.assert_array_equal(coarse.occupancy, blocks.max(axis=(2, 4, 6)))
    np.testing.assert_allclose(coarse.entropy, (blocks > 0).mean(axis=(2, 4, 6)) * math.log(2),
                               rtol=1e-5)
    assert coarse_volume(np.zeros((1, 24, 24, 24), np.float32)).side == 12


def test_a_line_of_sight_goes_from_cell_to_neighbouring_cell():
    lines = image_lines(ring(0.37, [0.41, 2.2])[0], SIDE, 16)
    places = np.stack(np.unravel_index(np.minimum(lines.cells, SIDE ** 3 - 1), (SIDE,) * 3))
    steps = np.abs(np.diff(places, axis=1)).sum(axis=0)
    assert set(steps[lines.cells[1:] < SIDE ** 3].tolist()) == {1}
    assert (np.diff(lines.entries, axis=0)[lines.cells[1:] < SIDE ** 3] > 0).all()


def test_a_line_to_a_cell_ends_before_it_and_the_nearest_cells_are_behind_nothing():
    pose = orbit_camera(0.41, 0.37).pose
    cells = cell_lines(pose, SIDE)
    assert not (cells == np.arange(SIDE ** 3)).any()
    count = (cells < SIDE ** 3).sum(axis=0)
    corner = np.ravel_multi_index((SIDE - 1,) * 3, (SIDE,) * 3)
    assert count[corner] == 0 and count[0] > SIDE


def test_a_camera_beside_the_cube_and_one_above_it_see_it_too():
    cells = np.ones((SIDE,) * 3)
    for pose in (ring(0.0, [0.0], 0.7), ring(1.5, [0.3])):
        seen = rendered(cells, pose)
        assert seen.silhouette[0, 0, 5:11, 5:11].min() == 1 and np.isfinite(seen.depth).all()
