"""What viser is given to show: the bars are as high as the scores, however often they change."""

import math
from types import SimpleNamespace

from active_recon.geometry.cameras import (
    AZIMUTHS,
    CANONICAL_INTRINSICS,
    Intrinsics,
    orbit_camera,
)
from active_recon.policies.reasons import GoalReason
from active_recon.viewer.scene import relative_scores, Scene, score_boxes
from active_recon.viewer.state import LoopState, Scores
from active_recon.viewer.view_result import ViewResult
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest


class Shown:
    """Stands for viser's scene: keeps what was added by its name."""

    def __init__(self):
        self.boxes = {}
        self.cameras = {}
        self.words = []

    def add_batched_meshes_simple(self, name, vertices, faces, wxyzs, positions, **others):
        self.boxes[name] = SimpleNamespace(
            vertices=vertices, batched_wxyzs=wxyzs, batched_positions=positions,
            remove=lambda: None, **others)
        return self.boxes[name]

    def add_camera_frustum(self, name, fov, aspect, **others):
        self.cameras[name] = SimpleNamespace(
            fov=fov, aspect=aspect, remove=lambda: None, **others)
        return self.cameras[name]

    def add_label(self, name, words, **others):
        self.words.append(words)
        return SimpleNamespace()

    def __getattr__(self, name):
        return lambda *args, **kwargs: SimpleNamespace(remove=lambda: None)


@pytest.fixture
def shown():
    return Shown()


def standing(azimuths, elevation=0.5):
    """Return the positions of cameras, (N, 3)."""
    return np.array([orbit_camera(azimuth, elevation).position for azimuth in azimuths])


def heights(bars):
    """Return how high the browser shows the bars: it reads scales as 32 bits each."""
    scales = np.frombuffer(bars.batched_scales.tobytes(), np.float32).reshape(-1, 3)
    assert len(scales) == len(bars.batched_positions)
    return np.ptp(bars.vertices[:, 2]) * scales[:, 2]


def test_bars_are_as_high_as_the_scores_say_at_first_and_when_they_change(shown):
    scene = Scene(shown, 1.0)
    for scores in (np.arange(24.0), np.arange(24.0)[::-1] ** 2):
        scene.draw(LoopState(scores=Scores(standing(AZIMUTHS), scores)), 0.5)
        bars = shown.boxes['/scores']
        found = heights(bars)
        np.testing.assert_allclose(found, 0.3 * relative_scores(scores), rtol=1e-5)
        # They stand on the floor
        np.testing.assert_allclose(bars.batched_positions[:, 2] - found / 2, -0.5, atol=1e-6)


def test_candidates_without_a_finite_score_have_no_bar(shown):
    scene = Scene(shown, 1.0)
    for without in (-math.inf, math.nan):
        scores = Scores(standing(AZIMUTHS), np.array([without, *range(23)]))
        scene.draw(LoopState(scores=scores), 0.5)
        np.testing.assert_allclose(
            heights(shown.boxes['/scores']), 0.3 * relative_scores(np.arange(23.0)), rtol=1e-5)
    scene.draw(LoopState(scores=Scores(np.zeros((0, 3)), np.zeros(0))), 0.5)
    assert '/scores' not in scene._objects


def test_a_camera_has_the_shape_of_its_images_once_its_lens_is_known(shown):
    scene = Scene(shown, 1.0)
    for lens in (CANONICAL_INTRINSICS, Intrinsics(600, 600, 320, 180, 640, 360)):
        scene.draw(LoopState(camera=orbit_camera(0.3, intrinsics=lens)), 0.5)
    camera = shown.cameras['/camera']
    assert camera.aspect == pytest.approx(640 / 360)
    assert camera.fov == pytest.approx(2 * math.atan(180 / 600))


def test_views_have_their_numbers_in_the_episode_once_these_are_known(shown):
    scene = Scene(shown, 1.0, has_front=False)
    views = (ViewResult(110, orbit_camera(0.0)), ViewResult(130, orbit_camera(math.pi / 2)))
    for missed in (0, 3):
        scene.draw(LoopState(views=views, missed=missed), 0.5)
    assert shown.words == ['1 · 0°', '2 · 90°', '4 · 0°', '5 · 90°']


@pytest.mark.parametrize(('gain', 'told'), [
    (0.0123, '+0.012'), (-0.0123, '-0.012'), (-0.0001, '+0.000')])
def test_an_expected_gain_has_one_sign(shown, gain, told):
    reason = GoalReason('shows the top', gain)
    Scene(shown, 1.0, has_front=False).draw(
        LoopState(goal=orbit_camera(math.pi), goal_reason=reason), 0.5)
    assert shown.words == [f'next · 180° · IoU {told}']
    assert reason.sentence.endswith(f'gain of IoU {told.removeprefix("+")}')


def test_scores_at_several_elevations_are_cubes_in_their_directions_the_larger_the_better():
    positions = np.concatenate([standing(AZIMUTHS), standing(AZIMUTHS, 1.0)])
    scores = np.random.default_rng(0).normal(size=48)
    centers, sides = score_boxes(Scores(positions, scores))
    np.testing.assert_allclose(np.cross(centers, positions), 0, atol=1e-9)
    np.testing.assert_array_equal(np.argsort(sides[:, 0]), np.argsort(scores))
    assert (sides == sides[:, :1]).all()


@pytest.mark.parametrize('cells', [32, 64])
def test_cells_are_as_long_as_the_grid_has_them_after_an_empty_one_too(shown, cells):
    scene = Scene(shown, 1.0)
    for side, occupancy in ((32, 0), (cells, 1), (32, 0), (cells, 1)):
        grid = VoxelGrid(np.full((side,) * 3, occupancy, np.float32))
        scene.draw(LoopState(grid=grid), 0.5)
    boxes = shown.boxes['/occupancy']
    assert len(boxes.batched_positions) == cells ** 3 - (cells - 2) ** 3
    assert np.ptp(boxes.vertices[:, 0]) == pytest.approx(0.93 / cells)
