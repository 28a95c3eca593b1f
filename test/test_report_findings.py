"""Warnings: a clean run has none, and each is there only where it was earned."""

from dataclasses import replace
import math

from active_recon.bags.runs.image_gaps import ImageGaps
from active_recon.bags.runs.run import RecordedGoal
from active_recon.geometry.cameras import orbit_camera
from active_recon.policies.reasons import GoalReason
from active_recon.report.findings import findings
from active_recon.report.subject import Subject
from active_recon.report.words import key_words, view_numbers
from active_recon.volumes.voxels import VoxelGrid
from judged_quality import quality_of
import numpy as np
import pytest
from report_runs import changed, recorded_run


@pytest.fixture(scope='module')
def run():
    return recorded_run(policy='uniform', views=3)


def said(run, level='warning', **known):
    return [finding.text for finding in findings(Subject('A', run, run.episodes[0], **known))
            if finding.level == level]


def counted(run, **counts):
    heard = {'images': 80, 'images_unused': 77, 'views': 3}
    return replace(run, counters={'/reconstructor': heard | {
        key.replace('__', '/'): count for key, count in counts.items()}})


def test_clean_run_has_no_warnings(run):
    assert said(run) == []


def test_late_poses_and_dropped_images_are_told_with_their_number(run):
    assert said(counted(run, refused__no_pose=0)) == []
    [warning] = said(counted(run, refused__no_pose=7))
    assert warning.startswith('7 images were dropped')
    assert 'late poses' in warning


def test_images_that_nobody_counted_are_told(run):
    assert said(replace(run, gaps=ImageGaps(0.1, 0, 0.0, 0))) == []
    [gap] = said(replace(run, gaps=ImageGaps(0.1, 7, 0.8)))
    assert 'About 7 images are missing' in gap and 'every 100 ms' in gap and '0.8 s' in gap
    [uncounted] = said(replace(run, gaps=ImageGaps(0.1, uncounted=9)))
    assert uncounted.startswith('9 images that were recorded never reached')


def test_one_is_told_as_one(run):
    [warning] = said(counted(run, refused__no_pose=1))
    assert warning.startswith('1 image was dropped: no camera pose arrived close enough to it')
    [gap] = said(replace(run, gaps=ImageGaps(0.1, 1, 0.2)))
    assert 'About 1 image is missing' in gap
    [uncounted] = said(replace(run, gaps=ImageGaps(0.1, uncounted=1)))
    assert uncounted.startswith('1 image that was recorded')


@pytest.mark.parametrize(('count', 'often'), [(1, 'once'), (2, 'twice'), (3, '3 times')])
def test_what_nodes_warned_of_is_told_in_words(run, count, often):
    [warning] = said(counted(run, warned__stalled=count))
    assert warning == (f'The reconstructor warned {often} of a camera that stood still away from '
                       'its goal.')
    [unknown] = said(counted(run, warned__lost_marbles=count))
    assert 'of lost marbles.' in unknown


@pytest.mark.parametrize(('key', 'words'), [
    ('refused/no_pose', 'rejected: no pose'), ('warned/noisy_poses', 'warned of poses that jump'),
    ('dropped/unheard', 'images lost on the way'), ('weights_sha256', 'weights (SHA-256)'),
    ('dropped/new_kind', 'dropped: new kind'),
    ('warned/qos/camera/image_raw', 'warned of incompatible QoS profiles (camera/image_raw)')])
def test_counters_and_records_have_words(key, words):
    assert key_words(key) == words


def test_what_some_views_lack_was_lost_on_the_way_and_is_told(run):
    first, second, third = run.episodes[0].views
    [warning] = said(changed(run, views=[
        replace(first, goal=None), replace(second, latent=None), replace(third, latent=None)]))
    assert 'lacks the latent of views 2, 3, the goal after view 1' in warning
    told = replace(second, goal=replace(second.goal, reason=GoalReason('shows the top')))
    [warning] = said(changed(run, views=[first, told, third]))
    assert 'lacks the reason of the goal after view 1:' in warning
    assert 'reason' not in said(changed(run, views=[replace(first, goal=None), told, third]))[0]
    nothing = [replace(view, latent=None) for view in run.episodes[0].views]
    assert said(changed(run, views=nothing)) == []  # nobody recorded it


def test_refusal_of_a_kind_unknown_here_is_told_by_its_name(run):
    [warning] = said(counted(run, refused__gremlins=2))
    assert '2 messages were rejected (gremlins)' in warning


@pytest.mark.parametrize(('reason', 'level', 'words'), [
    ('max_views', 'note', 'as many views'),
    ('entropy_settled', 'note', 'by itself'),
    ('battery', 'note', 'battery'),
    ('photos', 'note', 'It ended with the last photo.'),
    ('', 'warning', 'The episode is incomplete'),
])
def test_reason_to_stop_is_told(run, reason, level, words):
    assert any(words in text for text in said(changed(run, done=reason), level))


def test_run_without_a_planner_is_not_cut_off(run):
    views = [replace(view, goal=None) for view in run.episodes[0].views]
    unplanned = changed(run, done='', first_goal=None, views=views)
    assert said(unplanned) == []
    assert any('No planner' in text for text in said(unplanned, 'note'))


@pytest.mark.parametrize(('aside_deg', 'above_deg', 'told'), [
    (5, 0, []), (14, 0, [12]), (-14, 0, [12]), (0, 5, []), (0, 12, [12]), (0, -12, [12])])
def test_view_off_its_goal_is_told_beyond_the_tolerance(run, aside_deg, above_deg, told):
    camera = run.episodes[0].views[0].camera
    asked = RecordedGoal(
        orbit_camera(camera.azimuth + math.radians(aside_deg),
                     camera.elevation + math.radians(above_deg)), 0, None, None, 0)
    assert said(changed(run, first_goal=asked)) == [
        f'View 1 was taken {off}° away from its goal.' for off in told]


@pytest.mark.parametrize(('elevation_deg', 'warned'), [(30, False), (34, False), (45, True)])
def test_other_elevation_is_told(run, elevation_deg, warned):
    view = run.episodes[0].views[0]
    camera = orbit_camera(view.camera.azimuth, math.radians(elevation_deg))
    there = changed(run, first_goal=None, views=[replace(view, camera=camera)])
    assert not said(there)  # the network takes any camera
    bound = replace(there, provenance=run.provenance | {'needs_front': 'true'})
    assert bool(said(bound)) == warned
    anywhere = replace(there, provenance={**there.provenance, 'needs_front': 'false'})
    assert not said(anywhere)


def test_shape_that_was_not_recorded_is_told(run):
    assert any('abc' in text for text in said(run, 'note', computed='the weights abc'))
    assert not any('weights' in text for text in said(run, 'note'))


def suspected(run, *suspects, **changes):
    views = [replace(view, quality=quality_of(suspect=suspect))
             for view, suspect in zip(run.episodes[0].views, suspects, strict=True)]
    return changed(run, views=views, **changes)


def test_equal_warnings_of_several_views_are_one_line(run):
    [warning] = said(suspected(run, 'pose', 'pose', 'pose'))
    assert warning.startswith('After views 1 to 3: unusual views (p = 0.010): what the ')
    first, second = said(suspected(run, 'pose', 'mask', 'pose'))
    assert first.startswith('After views 1, 3: ') and 'poses right?' in first
    assert second.startswith('After view 2: ') and 'mask' in second
    assert said(suspected(run, '', '', '')) == []


@pytest.mark.parametrize(('numbers', 'words'), [
    ([3], 'view 3'), ([1, 2], 'views 1, 2'), ([1, 2, 3], 'views 1 to 3'),
    ([1, 3, 4, 5, 9, 10], 'views 1, 3 to 5, 9, 10')])
def test_views_are_named_by_their_numbers_and_three_in_a_row_by_the_first_and_last(numbers, words):
    assert view_numbers(numbers) == words


@pytest.mark.parametrize(('done', 'asked'), [
    ('max_views', 'is object_size right?'), ('photos', 'is the cube (--box, --size) right?')])
def test_a_cube_that_does_not_fit_is_asked_for_by_the_names_of_what_set_it(run, done, asked):
    [warning] = said(suspected(run, '', '', 'object_size', done=done))
    assert warning.endswith(asked)


def test_an_object_that_is_small_in_its_cube_is_told_once_with_what_would_fit(run):
    last = run.episodes[0].views[-1]
    cells = np.zeros_like(last.reconstruction.occupancy)
    cells[20:40, 20:40, 20:40] = 0.9
    small = replace(last, reconstruction=VoxelGrid(cells), occupied=VoxelGrid(cells))
    wide = changed(counted(run, warned__cube=1),
                   views=[*run.episodes[0].views[:-1], small])
    [warning] = said(wide)
    assert warning.startswith('The object fills 31% of the side of its cube, which costs accuracy')
    assert 'object_size 0.312 fits it' in warning


def test_warnings_come_before_notes(run):
    levels = [finding.level for finding in findings(
        Subject('A', counted(run, refused__no_pose=1), run.episodes[0]))]
    assert levels == sorted(levels, key=['warning', 'note'].index)
    assert set(levels) == {'warning', 'note'}
