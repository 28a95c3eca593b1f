"""What is known of the loop, in whatever order it is heard, and the words that tell it."""

from contextlib import nullcontext
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from urllib.request import urlopen

from active_recon.bags.runs.run import (
    Candidates,
    RecordedEpisode,
    RecordedGoal,
    RecordedRun,
    RecordedView,
)
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.policies.reasons import GoalReason
from active_recon.viewer.link import ago, goal_lines, status_lines, TopicLink
from active_recon.viewer.page import Page
from active_recon.viewer.playback import recorded_states
from active_recon.viewer.scene import certainty_colors, relative_scores, shown_cells
from active_recon.viewer.state import (
    entropy_lines,
    LoopState,
    Observer,
    own_threshold,
    Scores,
    thumbnail,
)
from active_recon.viewer.view_result import Surface, ViewResult
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import viser
from websockets.asyncio import server
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

GRID = VoxelGrid(np.random.default_rng(0).random((8, 8, 8), np.float32))
OCCUPIED = VoxelGrid(np.full((8, 8, 8), 0.405, np.float32))
LATER_GRID = VoxelGrid(np.ones((8, 8, 8), np.float32))
SCORES = Scores(
    np.array([orbit_camera(azimuth).position for azimuth in AZIMUTHS]), np.arange(24.0))
TOPICS = {'image': '/camera/image_raw', 'view': '/view', 'occupancy': '/occupancy',
          'goal': '/next_view'}


def view(stamp, entropy=1.0):
    return ViewResult(stamp, orbit_camera(0.1 * stamp), None, entropy)


def links(publishers=1, ago_s=None, **changed):
    """Return the links to all topics alike, but for those given by their role."""
    return {role: changed.get(role, TopicLink(topic, publishers, ago_s))
            for role, topic in TOPICS.items()}


def summary(state):
    return (state.episode, [taken.stamp for taken in state.views], state.grid, state.threshold,
            state.goal, state.scores, state.done, state.missed)


REASON = GoalReason('shows the top', 0.0421)


GOAL, FIRST, SECOND = orbit_camera(1.0), view(110), view(130)
MESSAGES = (
    lambda observer: observer.begin_episode('b', 100),
    lambda observer: observer.add_view(FIRST, GRID, OCCUPIED),
    lambda observer: observer.set_goal(120, GOAL),
    lambda observer: observer.set_scores(120, SCORES),
    lambda observer: observer.add_view(SECOND, LATER_GRID, OCCUPIED),
    lambda observer: observer.set_count(130, 3),
    lambda observer: observer.set_done(130, 'max_views'))


def state_after(order):
    observer = Observer()
    observer.begin_episode('a', 10)
    for hear in order:
        hear(observer)
    return summary(observer.state)


def test_the_order_in_which_latched_messages_come_makes_no_difference():
    expected = state_after(MESSAGES)
    assert all(state_after(order) == expected for order in permutations(MESSAGES))
    assert expected == (
        'b', [110, 130], LATER_GRID, 0.4, None, SCORES, 'max_views', 1)


def test_a_reason_belongs_to_the_goal_of_its_stamp_whichever_comes_first():
    parts = [lambda observer: observer.set_goal(120, GOAL),
             lambda observer: observer.set_goal_reason(120, REASON)]
    for order in permutations(parts):
        observer = Observer()
        for hear in order:
            hear(observer)
        assert observer.state.goal_reason is REASON
        observer.set_goal(140, GOAL)
        assert observer.state.goal_reason is None


def test_a_reason_goes_with_its_goal():
    for end in (lambda observer: observer.set_done(130, 'max_views'),
                lambda observer: observer.begin_episode('c', 200)):
        observer = Observer()
        observer.begin_episode('b', 100)
        observer.set_goal(120, GOAL)
        observer.set_goal_reason(120, REASON)
        assert goal_lines(observer.state) == [
            f'Next view, {np.degrees(1.0):.0f}°: shows the top; expected gain of IoU 0.042.']
        end(observer)
        assert observer.state.goal_reason is None
        assert goal_lines(observer.state) == []


def test_why_the_next_view_is_worth_taking_stands_among_the_lines_of_the_page():
    state = LoopState(goal=GOAL, goal_reason=REASON)
    assert goal_lines(state)[0] in status_lines(links(), state)


def test_what_is_stamped_before_the_episode_is_left_out():
    observer = Observer()
    observer.begin_episode('b', 100)
    observer.add_view(view(99), GRID, OCCUPIED)
    observer.set_goal(98, GOAL)
    observer.set_scores(98, SCORES)
    observer.set_done(99, 'max_views')
    assert summary(observer.state) == ('b', [], None, None, None, None, '', 0)


def test_a_new_episode_forgets_the_last_but_not_where_the_camera_is():
    observer = Observer()
    camera, picture = orbit_camera(2.0), np.zeros((4, 4, 3), np.uint8)
    observer.begin_episode('a', 0)
    observer.set_camera(camera, picture)
    observer.add_view(view(1), GRID, OCCUPIED)
    observer.set_goal(2, GOAL)
    observer.set_scores(2, SCORES)
    observer.begin_episode('b', 100)
    assert summary(observer.state) == ('b', [], None, None, None, None, '', 0)
    assert observer.state.camera is camera
    assert observer.state.picture is picture


def test_an_episode_of_a_time_before_the_last_begins_with_nothing():
    observer = Observer()
    observer.begin_episode('a', 100)
    observer.add_view(FIRST, GRID, OCCUPIED)
    observer.set_goal(120, GOAL)
    observer.set_done(130, 'max_views')
    observer.begin_episode('b', 10)
    assert summary(observer.state) == ('b', [], None, None, None, None, '', 0)
    observer.set_goal(20, GOAL)
    assert observer.state.goal is GOAL


def test_an_episode_or_a_view_or_a_goal_heard_again_changes_nothing():
    observer = Observer()
    for _ in range(2):
        observer.begin_episode('a', 0)
        observer.add_view(FIRST, GRID, OCCUPIED)
        observer.set_goal(120, GOAL)
        state = observer.state
    observer.set_goal(120, orbit_camera(3.0))
    assert observer.state is state
    assert len(state.views) == 1


def test_a_goal_after_the_end_takes_the_end_back():
    observer = Observer()
    observer.add_view(FIRST, GRID, OCCUPIED)
    observer.set_done(110, 'max_views')
    observer.set_goal(120, GOAL)
    assert (observer.state.done, observer.state.goal) == ('', GOAL)


@pytest.mark.parametrize('threshold', [0.02, 0.3, 0.45, 0.9])
def test_the_own_threshold_of_occupied_cells_keeps_all_of_them(threshold):
    fine = VoxelGrid(np.linspace(0, 1, 32 ** 3, dtype=np.float32).reshape(32, 32, 32))
    occupied = VoxelGrid(np.where(fine.occupied(threshold), fine.occupancy, 0))
    found = own_threshold(occupied)
    assert found == pytest.approx(threshold, abs=0.0101)
    assert (fine.occupied(found) >= fine.occupied(threshold)).all()


@pytest.mark.parametrize('certain', [1.0, 0.5, 0.4])
def test_the_own_threshold_keeps_cells_that_are_all_as_certain(certain):
    cube = VoxelGrid(np.full((4, 4, 4), certain, np.float32))
    assert cube.occupied(own_threshold(cube)).all()


def test_a_grid_without_occupied_cells_has_no_own_threshold():
    assert own_threshold(VoxelGrid(np.zeros((4, 4, 4), np.float32))) is None


@pytest.mark.parametrize(('shape', 'small'), [
    ((137, 137), (137, 137)), ((480, 640), (120, 160)), ((1080, 1), (160, 1)),
    ((320, 160), (160, 80))])
def test_a_thumbnail_keeps_the_proportions_within_160_pixels(shape, small):
    assert thumbnail(np.zeros((*shape, 3), np.uint8)).shape == (*small, 3)


def test_entropies_that_are_unknown_are_gaps_in_the_line():
    numbers, entropies = entropy_lines([view(1, 5.0), view(2, None)])
    np.testing.assert_array_equal(numbers, [1, 2])
    np.testing.assert_array_equal(entropies, [5, np.nan])


def test_only_cells_that_touch_the_outside_are_shown_whatever_the_grids_size():
    full = VoxelGrid(np.ones((8, 8, 8), np.float32), 0.25)
    cells = shown_cells(full, 0.5)
    assert len(cells) == 8 ** 3 - 6 ** 3
    assert np.abs(cells[:, :3]).max() == pytest.approx(0.5 - 1 / 16)


def test_a_higher_threshold_never_shows_a_cell_outside_of_those_above_a_lower_one():
    for low, high in ((0.1, 0.4), (0.4, 0.8)):
        assert (GRID.occupied(high) <= GRID.occupied(low)).all()
        assert shown_cells(GRID, high)[:, 3].min() > high


def test_surer_cells_are_darker():
    colors = certainty_colors(np.linspace(0, 1, 20, dtype=np.float32)).astype(int)
    assert (np.diff(colors @ [0.3, 0.59, 0.11]) < 0).all()


@pytest.mark.parametrize('scores', [np.arange(24.0), -np.arange(24.0), np.full(24, 7.0)])
def test_bars_keep_the_order_of_the_scores_whatever_their_unit(scores):
    heights = relative_scores(scores)
    assert ((heights > 0) & (heights <= 1)).all()
    np.testing.assert_allclose(heights, relative_scores(3 * scores - 5))
    assert np.argmax(heights) == np.argmax(scores)


def test_a_link_to_nobody_says_what_it_waits_for():
    assert status_lines(links(publishers=0), LoopState()) == [
        'Waiting for a loop: no publisher yet on /camera/image_raw, /view, /occupancy, '
        '/next_view.']


def test_a_missing_publisher_is_named_and_whether_it_was_ever_there():
    words = status_lines(links(
        occupancy=TopicLink('/occupancy', 0), goal=TopicLink('/next_view', 0, 4.0)), LoopState())
    assert words == ['No view in this episode yet.', 'No publisher on /occupancy yet.',
                     'No publisher on /next_view any more.']


def test_the_last_view_the_end_and_a_silent_camera_are_told():
    state = LoopState(views=(view(1), view(2)))
    assert status_lines(links(ago_s=1.2), state) == ['2 views, the last 1 s ago.']
    assert status_lines(links(ago_s=1.2), LoopState(views=(view(1),))) == [
        '1 view, the last 1 s ago.']
    done = LoopState('1f', (view(1), view(2)), done='entropy_settled')
    assert status_lines(links(ago_s=130), done) == [
        'Done (entropy settled): 2 views, the last 2 min ago.',
        'No image for 2 min.', 'Episode 1f.']


def test_views_from_before_the_page_are_counted():
    state = LoopState(views=(view(1), view(2)), missed=3)
    assert status_lines(links(ago_s=1.2), state)[0] == '5 views, the last 1 s ago.'
    assert entropy_lines(state.views, state.missed)[0].tolist() == [4, 5]


@pytest.mark.parametrize(('seconds', 'words'), [
    (0.2, '0 s'), (59.4, '59 s'), (61, '1 min'), (3500, '58 min'), (7300, '2 h')])
def test_spans_of_time_are_told_in_whole_units(seconds, words):
    assert ago(seconds) == words


def test_a_recorded_goal_is_shown_where_its_own_camera_stands():
    camera = orbit_camera(2.0, 0.9, 3.0)
    ring = Candidates.of([orbit_camera(azimuth, 0.9, 3.0) for azimuth in AZIMUTHS])
    goal = RecordedGoal(camera, 101, ring, np.arange(24, dtype=np.float32), 101, reason=REASON)
    taken = RecordedView(100, np.zeros((8, 8, 3), np.uint8), orbit_camera(0.1, 0.9, 3.0), GRID,
                         None, None, 1.0, goal, {})
    run = RecordedRun(Path('run'), [RecordedEpisode('a', 0, None, [taken], '')], {}, {}, {}, [],
                      0, 1)
    (state,) = recorded_states(run)
    assert state.goal is camera
    np.testing.assert_allclose(state.scores.positions, ring.positions)
    assert state.goal_reason is REASON


def test_what_nodes_warn_of_stands_right_after_how_far_the_loop_is():
    problems = {'view_planner': 'no episode', 'reconstructor': 'no image'}
    told = ['reconstructor: no image', 'view_planner: no episode']
    assert status_lines(links(), LoopState(), problems)[1:3] == told
    assert status_lines(links(publishers=0), LoopState(), problems)[1:] == told


def test_a_surface_that_is_heard_before_its_episode_is_kept():
    observer = Observer()
    surface = Surface(np.zeros((1, 3, 3)), np.zeros((1, 3, 3), np.uint8))
    observer.set_surface(110, surface)
    observer.begin_episode('a', 100)
    assert observer.state.surface is surface
    observer.begin_episode('b', 120)
    assert observer.state.surface is None
    observer.set_surface(130, surface)
    observer.begin_episode('c', 10)  # the clock was set back
    assert observer.state.surface is None


def test_an_image_of_the_last_episode_is_not_that_of_the_next():
    observer = Observer()
    observer.begin_episode('a', 100)
    image = np.zeros((8, 8, 3), np.uint8)
    observer.set_network_image(50, image)
    assert observer.state.network_image is None
    observer.set_network_image(110, image)
    assert observer.state.network_image is image
    observer.begin_episode('b', 120)
    assert observer.state.network_image is None


def test_a_view_whose_image_was_missed_shows_what_the_network_received():
    observer = Observer()
    observer.begin_episode('a', 0)
    own, received = (np.full((8, 8, 3), value, np.uint8) for value in (1, 2))
    observer.add_view(replace(view(10), image=own), None, None)
    observer.add_view(view(20), None, None)
    for stamp in (10, 20):
        observer.set_network_image(stamp, received)
    assert [each.image for each in observer.state.views] == [own, received]


def test_names_that_are_not_of_utf8_are_shown_as_far_as_they_can_be():
    page = Page('gr\udcfcn')
    try:
        page.set_text(['Left out: z\udcfc.jpg: no board seen in it'])
        assert page._text.content == r'**Left out\: z\?\.jpg\: no board seen in it**'
        with connect(page.url.replace('http', 'ws'),
                     subprotocols=[f'viser-v{viser.__version__}']) as client:
            assert client.recv(timeout=10)
    finally:
        page.close()


@pytest.fixture
def served():
    shown = Page('a page')
    yield shown
    shown.close()


@pytest.mark.parametrize(('origin', 'may'), [
    (None, True), ('http://127.0.0.1:{port}', True), ('http://localhost:9000', True),
    ('http://evil.example', False), ('null', False), ('http://127.0.0.1.evil.example', False),
    ('http://evil.example:8080', False)])
def test_only_pages_of_this_machine_connect_to_the_page(origin, may, served):
    address = served.url.replace('http', 'ws')
    port = address.rpartition(':')[2]
    serve = server.serve
    with nullcontext() if may else pytest.raises(InvalidStatus, match='HTTP 403'):
        connect(address, origin=origin and origin.format(port=port),
                subprotocols=[f'viser-v{viser.__version__}']).close()
    assert server.serve is serve


def test_no_website_shows_the_page_in_a_frame(served):
    with urlopen(served.url, timeout=10) as answer:
        policy = answer.headers['Content-Security-Policy']
    assert policy.startswith('frame-ancestors http://127.0.0.1:*') and ' *' not in policy
