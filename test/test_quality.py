"""What is said of a shape without its truth: silhouettes, tests of the unusual, tables."""

from dataclasses import replace
import json
import math

from active_recon.errors import WeightsError
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.models.lifting import Lifting, LiftingConfig
from active_recon.models.weights_files import find_weights, weights_hash
from active_recon.quality.conformal import p_value, upper_quantile
from active_recon.quality.features import FEATURES, features
from active_recon.quality.judge import FEWEST_USUAL, Judge
from active_recon.quality.latents import KnownLatents, pooled
from active_recon.quality.quality import FALSE_ALARMS, SUSPECTS
from active_recon.quality.silhouettes import agreement, cube_outline, eroded, SeenView, silhouette
from active_recon.quality.tables import find_tables, QualityTables, tables_path
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes.torch import TorchRuntime
from active_recon.volumes.occupancy_threshold import expected_iou
from judged_quality import CHANNELS, COUNTS, quality_of, some_tables
import numpy as np
import pytest
from recorded_messages import small_disk
import torch

LENS = Intrinsics(75, 75, 32, 32, 64, 64)
CAMERAS = [orbit_camera(azimuth, 0.4, 2.2, LENS) for azimuth in (0.1, 1.4, 3.0, 4.4)]


def ball(radius=0.3, side=64):
    along = (np.arange(side) + 0.5) / side - 0.5
    x, y, z = np.meshgrid(along, along, along, indexing='ij')
    return np.sqrt(x * x + y * y + z * z) < radius


def points_of(cells):
    shell = cells & ~eroded(cells)
    return (np.argwhere(shell) + 0.5) / len(cells) - 0.5


def seen_as(cells, camera):
    """Return the view that shows the silhouette of cells, all of its image seen."""
    shown = silhouette(points_of(cells), camera).astype(np.float32)
    return SeenView(camera, shown, np.ones_like(shown))


def named(numbers):
    return dict(zip(FEATURES, numbers, strict=True))


def test_what_is_left_of_a_cube_lacks_its_outermost_cells_and_those_at_the_border_go():
    cells = np.zeros((8,) * 3, bool)
    cells[1:6, 2:7, 0:4] = True
    left = np.zeros_like(cells)
    left[2:5, 3:6, 1:3] = True
    assert (eroded(cells) == left).all()
    assert eroded(np.ones((4,) * 3, bool)).sum() == 8


@pytest.mark.parametrize('shape', [(9, 6, 7), (7, 9, 6)])
def test_a_cell_stays_where_its_six_neighbours_are_there_whatever_the_order_in_memory(shape):
    cells = np.random.default_rng(0).random(shape) < 0.9
    around, left = np.pad(cells, 1), cells.copy()
    for axis in range(3):
        for step in (-1, 1):
            left &= np.roll(around, step, axis)[1:-1, 1:-1, 1:-1]
    assert left.any()
    for order in ((0, 1, 2), (2, 0, 1)):
        np.testing.assert_array_equal(eroded(cells.transpose(order)), left.transpose(order))


@pytest.mark.parametrize('camera', CAMERAS)
def test_the_surface_casts_the_silhouette_of_all_cells_and_leaves_no_hole(camera):
    cells = ball()
    every = (np.argwhere(cells) + 0.5) / 64 - 0.5
    whole = silhouette(every, camera)
    assert (silhouette(points_of(cells), camera) == whole).all()
    rows = whole[whole.any(axis=1)]
    assert all((np.diff(np.flatnonzero(row)) == 1).all() for row in rows)


def test_a_ball_is_as_wide_as_its_angle_says():
    camera, radius = CAMERAS[0], 0.3
    expected = 2 * LENS.fx * math.tan(math.asin(radius / camera.distance))
    assert np.ptp(np.argwhere(silhouette(points_of(ball(radius)), camera))[:, 1]) + 1 == (
        pytest.approx(expected, abs=1.5))


@pytest.mark.parametrize('camera', CAMERAS)
def test_a_full_grid_fills_the_outline_of_the_cube(camera):
    filled = silhouette(points_of(np.ones((64,) * 3, bool)), camera)
    outline = cube_outline(camera)
    assert (filled ^ outline).sum() < 0.05 * outline.sum()  # pixels at the edge


def test_a_shape_agrees_with_its_own_silhouettes_and_less_with_another_s():
    cells = ball()
    for camera in CAMERAS:
        own = agreement(points_of(cells), seen_as(cells, camera))
        assert (own.iou, own.missed, own.extra, own.outside, own.unsure) == (1, 0, 0, 0, 0)
        larger = agreement(points_of(cells), seen_as(ball(0.4), camera))
        assert larger.missed > 0.3 and larger.extra == 0
        smaller = agreement(points_of(cells), seen_as(ball(0.2), camera))
        assert smaller.extra > 0.3 and smaller.missed == 0


def test_pixels_that_the_camera_did_not_see_say_nothing():
    cells, camera = ball(), CAMERAS[0]
    view = seen_as(cells, camera)
    half = np.ones_like(view.seen)
    half[:, 32:] = 0
    broken = np.where(half > 0, view.foreground, 1 - view.foreground)
    assert agreement(points_of(cells), replace(view, foreground=broken, seen=half)).iou == 1


def test_foreground_beyond_the_cube_is_outside():
    view = SeenView(CAMERAS[0], np.ones((64, 64), np.float32), np.ones((64, 64), np.float32))
    outside = agreement(points_of(ball()), view).outside
    assert outside == pytest.approx(1 - cube_outline(CAMERAS[0]).mean())


@pytest.mark.parametrize('empty', [False, True])
def test_the_features_are_finite_for_every_shape_even_none(empty):
    occupancy = np.where(ball() & (not empty), 0.9, 0.01).astype(np.float32)
    views = [seen_as(ball(), camera) for camera in CAMERAS]
    found = features(occupancy, 0.4, views)
    assert np.isfinite(found).all() and len(found) == len(FEATURES)


def test_the_first_feature_is_the_one_expected_iou_of_the_package():
    occupancy = np.where(ball(), 0.8, 0.001).astype(np.float32)
    found = named(features(occupancy, 0.4, [seen_as(ball(), CAMERAS[0])]))
    share = expected_iou(occupancy, occupancy > 0.4)
    assert found['expected'] == pytest.approx(math.log(share / (1 - share)))
    assert found['iou'] == found['worst_iou'] == 1


def test_the_order_of_the_views_makes_no_difference():
    occupancy = np.where(ball(0.25), 0.8, 0.001).astype(np.float32)
    views = [seen_as(ball(), camera) for camera in CAMERAS]
    np.testing.assert_allclose(
        features(occupancy, 0.4, views), features(occupancy, 0.4, views[::-1]), rtol=1e-12)


@pytest.mark.parametrize('miss', [0.05, 0.1, 0.3])
def test_a_new_score_exceeds_the_quantile_no_more_often_than_was_allowed(miss):
    rng = np.random.default_rng(1)
    draws = rng.exponential(size=(4000, 60))
    beyond = [draw[-1] > upper_quantile(draw[:-1], miss) for draw in draws]
    assert miss - 0.03 < np.mean(beyond) < miss + 0.015


def test_too_few_scores_bound_nothing():
    assert upper_quantile(np.arange(8), 0.1) == math.inf
    assert upper_quantile(np.arange(9), 0.1) == 8


def test_p_values_of_usual_scores_are_evenly_spread_and_those_of_unusual_ones_small():
    rng = np.random.default_rng(2)
    usual = np.sort(rng.normal(size=999)).tolist()
    found = np.array([p_value(score, usual) for score in rng.normal(size=4000)])
    for level in (0.05, 0.2, 0.5):
        assert np.mean(found <= level) == pytest.approx(level, abs=0.04)
    assert p_value(9.0, usual) == 1 / 1000


def test_a_latent_s_distance_does_not_depend_on_the_units_of_its_channels():
    rng = np.random.default_rng(3)
    found = rng.normal(size=(500, 6))
    scale = np.array([1e-1, 1, 1e2, 3, 0.3, 7])
    new = rng.normal(size=(20, 6)) * 3
    np.testing.assert_allclose(KnownLatents.of(found).distances(new),
                               KnownLatents.of(found * scale).distances(new * scale), rtol=1e-3)


def test_pooled_latents_do_not_depend_on_where_in_the_map_something_is():
    latent = np.random.default_rng(4).normal(size=(5, 4, 4))
    np.testing.assert_allclose(pooled(latent), pooled(latent[:, ::-1, ::-1]))


def judged(numbers, count=2, tables=None, around=True):
    return Judge(tables or some_tables()).judge_numbers(np.asarray(numbers), count, around)


def of_any_cameras(tables):
    """Return tables to which views of no turntable are usual, whatever they are like."""
    return replace(tables, usual_scores_any=[[99.0] * 50] * COUNTS,
                   usual_distances_any=[[999.0] * 50] * COUNTS)


def test_what_is_unusual_on_a_turntable_may_be_usual_from_any_cameras():
    far = np.append(np.zeros(len(FEATURES)), 99.0)
    tables = of_any_cameras(some_tables())
    assert judged(far, around=False).suspect and judged(far, tables=tables).suspect
    assert judged(far, tables=tables, around=False).p_value == 1


def test_it_takes_so_many_usual_views_for_one_to_be_flagged():
    far = np.append(np.zeros(len(FEATURES)), 99.0)
    for count, flagged in ((FEWEST_USUAL - 1, False), (FEWEST_USUAL, True)):
        few = [[-99.0] * count] * COUNTS
        tables = replace(some_tables(), usual_scores=few, usual_distances=few)
        assert tables.fewest_usual == count
        assert bool(judged(far, tables=tables).suspect) == flagged


def test_a_first_view_is_judged_as_of_any_camera_since_it_tells_no_turntable():
    far = np.append(np.zeros(len(FEATURES)), 99.0)
    tables = of_any_cameras(some_tables())
    assert [bool(judged(far, count, tables).suspect) for count in (1, 2)] == [False, True]


@pytest.mark.parametrize(('elevation_deg', 'distance', 'suspected'), [
    (20, 2, True), (21, 2.05, True), (24, 2, False), (20, 2.2, False)])
def test_views_of_one_elevation_and_distance_are_judged_as_of_a_turntable(
        elevation_deg, distance, suspected):
    cameras = [orbit_camera(0.3, math.radians(20), 2, LENS),
               orbit_camera(2, math.radians(elevation_deg), distance, LENS)]
    views = [seen_as(ball(), camera) for camera in cameras]
    tables = replace(of_any_cameras(some_tables()), usual_scores=[[-99.0] * 50] * COUNTS)
    quality = Judge(tables).judge(
        np.where(ball(), 0.8, 0.001), 0.4, np.zeros((CHANNELS, 2, 2)), views, 2)
    assert bool(quality.suspect) == suspected


def test_more_views_than_were_measured_are_judged_as_the_most():
    numbers = np.random.default_rng(5).normal(size=len(FEATURES) + 1)
    assert judged(numbers, COUNTS) == judged(numbers, COUNTS + 20)


def test_bounds_are_about_the_expected_iou_and_promises_below_it():
    for seed in range(20):
        numbers = np.random.default_rng(seed).normal(size=len(FEATURES) + 1)
        quality = judged(numbers, 1)
        assert quality.lower_bound == pytest.approx(max(quality.expected_iou - 0.2, 0))
        assert quality.attainable == pytest.approx(min(quality.expected_iou + 0.3, 1))
        expected = 0.7 if quality.expected_iou >= 0.85 else 0.5 * (quality.expected_iou >= 0.6)
        assert quality.promise == quality.promise_learned == expected


def test_what_the_learned_policy_promises_has_numbers_of_its_own(tmp_path):
    tables = replace(of_any_cameras(some_tables()), needed_learned=[0.1, 0.2])
    numbers = np.random.default_rng(0).normal(size=len(FEATURES) + 1)
    quality = judged(numbers, 1, tables)
    assert quality.expected_iou > 0.2
    assert quality.promise_learned == 0.7
    assert quality.promise == judged(numbers, 1).promise < 0.7
    tables.write(tmp_path / 'tables.json')
    assert QualityTables.read(tmp_path / 'tables.json') == tables
    with pytest.raises(WeightsError, match='needed_learned of a wrong shape'):
        replace(tables, needed_learned=[0.1])


def test_what_is_unusual_has_a_suspect_and_a_question_and_the_usual_has_none():
    tables = some_tables()
    for number in range(30):
        numbers = np.random.default_rng(number).normal(size=len(FEATURES) + 1)
        quality = judged(numbers)
        assert (quality.suspect in tables.suspects) == (quality.p_value <= FALSE_ALARMS)
        assert bool(quality.warning) == bool(quality.suspect)
    far = judged(np.append(np.zeros(len(FEATURES)), 99.0))
    assert far.p_value <= FALSE_ALARMS
    assert SUSPECTS[far.suspect] in far.warning


@pytest.mark.parametrize('suspect', ['', *SUSPECTS])
def test_photos_alone_are_warned_of_as_nodes_are_but_for_the_name_of_their_cube(suspect):
    quality = quality_of(suspect=suspect)
    assert quality.photo_warning == quality.warning.replace(
        'is object_size right?', 'is the cube (--box, --size) right?')
    assert ('object_size' in quality.warning) == (suspect == 'object_size')


def test_tables_come_back_from_their_file_and_judge_the_same(tmp_path):
    tables = some_tables()
    tables.write(tmp_path / 'tables.json', command='fit')
    again = QualityTables.read(tmp_path / 'tables.json')
    numbers = np.random.default_rng(6).normal(size=len(FEATURES) + 1)
    assert judged(numbers, tables=again) == judged(numbers)
    assert json.loads((tmp_path / 'tables.json').read_text())['command'] == 'fit'


def test_tables_that_a_full_disk_does_not_hold_leave_those_that_were_there(tmp_path):
    some_tables().write(tmp_path / 'tables.json')
    before = (tmp_path / 'tables.json').read_text()
    with small_disk(len(before) // 2), pytest.raises(OSError):
        some_tables().write(tmp_path / 'tables.json', command='fit')
    assert (tmp_path / 'tables.json').read_text() == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(('field', 'value'), [
    ('centre', [0.0]), ('head', [1.0]), ('suspects', ['pose', 'luck']), ('margin', []),
    ('usual_scores', [[0.0]]), ('usual_distances_any', [[0.0]])])
def test_tables_that_do_not_fit_each_other_are_refused(field, value):
    with pytest.raises(WeightsError, match='quality tables'):
        replace(some_tables(), **{field: value})


def test_tables_are_used_with_the_weights_that_they_were_fitted_to_alone(tmp_path):
    weights = tmp_path / 'my.safetensors'
    assert find_tables(weights, 'abc')[0] is None
    assert 'my-quality.json' in find_tables(weights, 'abc')[1]
    some_tables('abc').write(tables_path(weights))
    assert find_tables(weights, 'abc') == (some_tables('abc'), '')
    tables, why = find_tables(weights, 'xyz')
    assert tables is None and 'other weights' in why
    tables_path(weights).write_text('{}')
    with pytest.raises(WeightsError, match='no readable quality tables'):
        find_tables(weights, 'abc')


@pytest.mark.parametrize('model', ['lifting', 'lifting-large'])
def test_the_tables_that_ship_are_of_the_weights_that_ship(model):
    weights = find_weights(model)
    tables, why = find_tables(weights, weights_hash(weights))
    assert tables is not None, why
    assert list(tables.needed) == sorted(tables.needed)


def reconstructor_with(tables):
    torch.manual_seed(0)
    network = Lifting.from_config(LiftingConfig(
        (8, 8, 8, 8), 8, 8, CHANNELS, 4, (8, 8, 8), 8))
    return Reconstructor(TorchRuntime(network, 0.3, 1), tables=tables)


def test_judging_the_quality_changes_no_bit_of_the_reconstruction():
    judging, plain = (reconstructor_with(tables) for tables in (some_tables(), None))
    rng = np.random.default_rng(7)
    for azimuth in (0.0, 2.0, 4.0):
        image = rng.integers(0, 256, (137, 137, 3), np.uint8)
        own, other = (each.add_view(image, orbit_camera(azimuth)) for each in (judging, plain))
        assert np.array_equal(own.grid.occupancy, other.grid.occupancy)
        assert np.array_equal(own.latent, other.latent)
        assert other.quality is None and 0 < own.quality.expected_iou < 1


def test_an_episode_is_judged_as_if_there_had_been_none_before():
    judging = reconstructor_with(some_tables())
    image = np.random.default_rng(8).integers(0, 256, (137, 137, 3), np.uint8)
    first = judging.add_view(image, orbit_camera(1.0)).quality
    judging.add_view(255 - image, orbit_camera(3.0))
    judging.reset()
    assert judging.add_view(image, orbit_camera(1.0)).quality == first
