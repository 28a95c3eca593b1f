"""The map of the turntable: where things stand on it, and that the bars show the scores."""

from dataclasses import replace
import math

from active_recon.bags.runs.run import Candidates, RecordedGoal
from active_recon.geometry.cameras import azimuth_difference, AZIMUTHS, orbit_camera
from active_recon.report.subject import Subject
from active_recon.report.turntable_map import place, spread_out, turntable_map
import numpy as np
import pytest
from report_runs import changed, recorded_run


@pytest.fixture(scope='module')
def run():
    return recorded_run(policy='uniform', views=3)


def drawn(run):
    return turntable_map(Subject('A', run, run.episodes[0]))


def bars(run, scores):
    """Return the lengths of the first view's bars, (24,)."""
    candidates = Candidates.of([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    goal = RecordedGoal(orbit_camera(0.0), 0, candidates, np.asarray(scores, np.float32), 0)
    [trace] = [trace for trace in drawn(changed(run, first_goal=goal))['data']
               if trace['type'] == 'barpolar' and trace['meta'] == {'of': 0}]
    np.testing.assert_allclose(trace['theta'], np.degrees(AZIMUTHS))
    return np.array(trace['r'])


def test_of_several_elevations_a_bar_shows_the_best_candidate_near_its_azimuth(run):
    rng = np.random.default_rng(2)
    cameras = [orbit_camera(azimuth + turn, elevation) for elevation, turn in (
        (0.1, 0.0), (0.6, 0.05), (1.2, -0.05)) for azimuth in AZIMUTHS]
    scores = rng.normal(size=(3, 24)).astype(np.float32)
    goal = RecordedGoal(cameras[0], 0, Candidates.of(cameras), scores.ravel(), 0)
    [trace] = [trace for trace in drawn(changed(run, first_goal=goal))['data']
               if trace['type'] == 'barpolar' and trace['meta'] == {'of': 0}]
    np.testing.assert_allclose(trace['theta'], np.degrees(AZIMUTHS))
    best = scores.max(axis=0)
    np.testing.assert_array_equal(np.argsort(trace['r']), np.argsort(best))
    elevations = np.degrees([0.1, 0.6, 1.2]).round().astype(int)[scores.argmax(axis=0)]
    for words, score, elevation in zip(trace['text'], best, elevations, strict=True):
        assert words.endswith(f'elevation {elevation}°: score {score:.4g}')


@pytest.mark.parametrize(('azimuth_deg', 'at'), [
    (0, (0, -1)), (90, (1, 0)), (180, (0, 1)), (270, (-1, 0))])
def test_front_is_below_and_azimuths_run_counter_clockwise(azimuth_deg, at):
    assert place(math.radians(azimuth_deg), 1) == pytest.approx(at)


@pytest.mark.parametrize('azimuths', [
    [0.0], [0.0, 0.0, 0.0], [0.1, 6.2, 0.0, 3.0], list(np.linspace(0, 6, 12)), [1.0] * 12])
def test_images_move_apart(azimuths):
    spread = spread_out(azimuths)
    away = np.abs(azimuth_difference(np.array(spread)[:, None], spread))
    np.fill_diagonal(away, np.inf)
    assert away.min() > math.radians(23)


def test_images_with_room_stay_where_their_cameras_were():
    azimuths = [0.0, 1.0, 2.5, 5.0]
    assert spread_out(azimuths) == azimuths


def test_longer_bars_are_better_scores(run):
    scores = np.random.default_rng(0).normal(size=24)
    assert (np.argsort(bars(run, scores)) == np.argsort(scores)).all()


def test_equal_scores_give_equal_bars(run):
    assert np.ptp(bars(run, np.full(24, 3.0))) < 1e-9


def test_every_view_shows_its_image_its_goal_and_its_number(run):
    figure = drawn(run)
    assert len(figure['layout']['images']) == 3
    numbers = [trace['text'][0] for trace in figure['data']
               if trace.get('mode') == 'markers+text']
    assert numbers == ['1', '2', '3']
    large = [trace['meta']['of'] for trace in figure['data']
             if trace.get('marker', {}).get('symbol') == 'diamond-open' and 'meta' in trace]
    assert large == [0, 1, 2]


def test_view_that_came_back_to_a_place_stands_beside_the_first(run):
    view = run.episodes[0].views[0]
    figure = drawn(changed(run, views=[view, view]))
    first, second = (trace for trace in figure['data'] if trace.get('mode') == 'markers+text')
    assert (first['x'], first['y']) != (second['x'], second['y'])


def test_goal_without_scores_is_still_drawn(run):
    goal = RecordedGoal(orbit_camera(1.0), 0, None, None, 0)
    views = [replace(view, goal=None) for view in run.episodes[0].views]
    figure = drawn(changed(run, first_goal=goal, views=views))
    assert not any(trace['type'] == 'barpolar' for trace in figure['data'])
    assert sum(trace.get('marker', {}).get('symbol') == 'diamond-open'
               for trace in figure['data']) == 2  # small, and large while view 1 is chosen
