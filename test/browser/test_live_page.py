"""The page in a real browser, with no ROS: what it draws, and its slider and buttons."""

from concurrent.futures import ThreadPoolExecutor

from active_recon.bags.runs.run import (
    Candidates,
    RecordedEpisode,
    RecordedGoal,
    RecordedRun,
    RecordedView,
)
from active_recon.errors import ConfigError, DataError
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.policies.reasons import GoalReason
from active_recon.viewer.page import Page
from active_recon.viewer.playback import PLAY, Playback
from active_recon.viewer.state import LoopState, Observer, Scores
from active_recon.viewer.view_result import Surface, ViewResult
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
import trimesh

pytestmark = pytest.mark.browser
PHONE = (390, 844)
LAPTOP = (1280, 800)
_SMALL = (900, 600)  # fast to draw without a graphics card
_SCENE = 560  # pixels to the left of the panel there
_BLOCK = 10  # pixels: the page draws more coarsely while the machine is busy


def ball(radius):
    """Return a ball that is surest at its middle."""
    axis = (np.arange(32) + 0.5) / 32 - 0.5
    away = np.sqrt(sum(part ** 2 for part in np.meshgrid(axis, axis, axis, indexing='ij')))
    return VoxelGrid(np.clip(1 - away / (2 * radius), 0, 1).astype(np.float32))


def picture(number):
    return np.full((137, 137, 3), (40 * number % 255, 90, 200 - 40 * number), np.uint8)


def taken(number):
    return ViewResult(100 * number, orbit_camera(1.3 * number), picture(number),
                     1000.0 / number)


@pytest.fixture(scope='module')
def end():
    """Return a function that ends pages beside the tests that follow: it takes 5 s each."""
    with ThreadPoolExecutor(16) as pool:
        ending = []
        yield lambda page: ending.append(pool.submit(page.close))
    for each in ending:
        each.result()


@pytest.fixture
def page(end):
    shown = Page('a page', port=0)
    yield shown
    end(shown)


def scene(chromium):
    """Return the scene's mean colours in blocks of pixels, (H, W, 3)."""
    picture = chromium.picture()[:, :_SCENE].astype(float)
    height, width = (length // _BLOCK for length in picture.shape[:2])
    return picture.reshape(height, _BLOCK, width, _BLOCK, 3).mean(axis=(1, 3))


def shown(chromium, draw, fits=lambda picture: True, what='the page at rest'):
    """Draw until the scene fits and no longer changes; return it."""
    last = None

    def at_rest():
        nonlocal last
        draw()
        before, last = last, scene(chromium)
        return before is not None and apart(before, last) < 0.002 and fits(last)

    chromium.until(at_rest, what, budget_s=60)
    return last


def apart(before, after):
    """Return the share of blocks, [0, 1], that differ visibly."""
    return float((np.abs(before - after).max(axis=-1) > 12).mean())


def opened(chromium, url, size=_SMALL):
    """Open a page and wait until it is drawn; close what a browser without a card complains of."""
    chromium.open(url, size)
    chromium.until(lambda: 'Threshold' in chromium.text(), 'the panel')
    chromium.until(lambda: chromium.run(_CLOSE_NOTES) == 0, 'no notes')


_CLOSE_NOTES = """
const notes = document.querySelectorAll('.mantine-Notification-closeButton');
notes.forEach((note) => note.click());
return notes.length
"""
_IMAGES = """
return [...document.querySelectorAll('img')].filter((one) => one.offsetParent).map(
    (one) => [one.naturalWidth, one.naturalHeight])
"""
_BUTTON = """
return [...document.querySelectorAll('button')].find((one) => one.innerText === arguments[0])
"""


def observed(views):
    observer = Observer()
    observer.begin_episode('a', 0)
    for number in range(1, views + 1):
        grid = ball(0.1 + 0.1 * number)
        observer.add_view(taken(number), grid, grid.above(0.5))
    observer.set_goal(1000, orbit_camera(5.5))
    around = np.array([orbit_camera(azimuth).position for azimuth in AZIMUTHS])
    observer.set_scores(1000, Scores(around, np.arange(24.0)))
    return observer.state


def test_a_new_view_changes_what_is_shown_and_nothing_complains(page, chromium):
    page.set_text(['1 view, the last 3 s ago.', 'No publisher on /next_view yet.'])
    opened(chromium, page.url)
    empty = shown(chromium, lambda: page.draw(LoopState()), lambda picture: apart(
        np.full_like(picture, 255), picture) > 0.01, 'the turntable')
    state = observed(1)
    first = shown(chromium, lambda: page.draw(state),
                  lambda picture: apart(empty, picture) > 0.01, 'the first view')
    state = observed(2)
    shown(chromium, lambda: page.draw(state),
          lambda picture: apart(first, picture) > 0.01, 'the second view')
    shown(chromium, lambda: page.draw(LoopState('b')),
          lambda picture: apart(empty, picture) < 0.003, 'an empty turntable again')
    assert '1 view, the last 3 s ago.' in chromium.text()
    assert 'No publisher on /next_view yet.' in chromium.text()
    assert not chromium.errors()


def test_a_surface_in_colours_has_them_on_every_side(page, chromium):
    box = trimesh.creation.box((0.9, 0.9, 0.9))
    colors = np.tile(np.array([180, 60, 20], np.uint8), (len(box.faces), 3, 1))
    state = LoopState('a', surface=Surface(box.triangles, colors))
    opened(chromium, page.url)
    empty = shown(chromium, lambda: page.draw(LoopState('a')))
    page.draw(state)
    chromium.until(lambda: 'In colours' in chromium.text(), 'the choice of colours')
    chromium.run("""[...document.querySelectorAll('input[type=checkbox]')].find(
        (one) => one.offsetParent).click()""")
    picture = shown(chromium, lambda: page.draw(state),
                    lambda picture: apart(empty, picture) > 0.02, 'the surface')
    red, green, blue = picture[np.abs(picture - empty).max(axis=-1) > 60].T
    inside = red > 2 * blue  # not the blocks at its outline
    assert inside.mean() > 0.8
    assert red[inside].min() > 60
    assert np.median(green[inside] / red[inside]) < 0.45
    assert not chromium.errors()


def test_the_threshold_is_the_loops_own_until_it_is_moved(page, chromium):
    state = observed(1)
    opened(chromium, page.url)
    before = shown(chromium, lambda: page.draw(state))
    field = chromium.driver.find_element('css selector', '.mantine-NumberInput-input')
    assert field.get_attribute('value') == '0.5'
    field.send_keys('\ue003' * 3 + '0.8\ue007')  # backspaces, enter
    shown(chromium, lambda: page.draw(state), lambda picture: apart(before, picture) > 0.003,
          'fewer cells')
    state = observed(2)  # whose own threshold is 0.5 as well
    shown(chromium, lambda: page.draw(state))
    assert field.get_attribute('value') == '0.8'
    assert not chromium.errors()


@pytest.mark.slow
def test_a_click_is_heard_once_and_a_button_can_be_out_of_reach(page, chromium):
    page.add_button('New episode', 'begin again')
    page.add_button('Next object', 'another one')
    page.enable('Next object', False)
    opened(chromium, page.url)
    chromium.run(f'({{}}, (() => {{{_BUTTON}}})(arguments[0])).click()', 'New episode')
    assert chromium.until(page.clicks, 'the click') == ['New episode']
    assert page.clicks() == []
    assert chromium.run(f'return (() => {{{_BUTTON}}})(arguments[0]).disabled', 'Next object')
    page.enable('Next object', True)
    chromium.until(lambda: not chromium.run(
        f'return (() => {{{_BUTTON}}})(arguments[0]).disabled', 'Next object'), 'the button')


def test_the_last_view_is_shown_as_the_network_saw_it(page, chromium):
    opened(chromium, page.url)
    chromium.driver.find_element('css selector', '[role=tab][title="Network image"]').click()
    chromium.until(lambda: 'as the network received it' in chromium.text(), 'the tab')
    observer = Observer()
    observer.set_network_image(1, np.full((96, 96, 3), (200, 30, 60), np.uint8))
    chromium.until(lambda: (page.draw(observer.state), chromium.run(_IMAGES))[1] == [[96, 96]],
                   'the image')
    assert 'as the network received it' not in chromium.text()
    observer.begin_episode('next', 2)
    chromium.until(lambda: (page.draw(observer.state), chromium.run(_IMAGES))[1] == [],
                   'no image of the next episode yet')
    assert not chromium.errors()


@pytest.mark.parametrize('size', [pytest.param(LAPTOP, marks=pytest.mark.slow), PHONE])
def test_words_and_controls_lie_within_the_window(page, chromium, size):
    page.add_button('New episode', 'begin again')
    page.set_text(['Waiting for a loop.'])
    opened(chromium, page.url, size)
    right, bottom = chromium.run(f"""
        const box = (() => {{{_BUTTON}}})(arguments[0]).getBoundingClientRect();
        return [box.right, box.bottom]""", 'New episode')
    assert 0 < right <= size[0]
    assert 0 < bottom <= size[1]
    assert 'Waiting for a loop.' in chromium.text()


def test_two_pages_take_two_ports(page):
    first = int(page.url.rpartition(':')[2])
    second = Page('another page', port=first)
    try:
        assert second.url != page.url
        assert second.port_taken
        assert not page.port_taken
    finally:
        second.close()


def test_a_port_that_cannot_be_is_refused():
    with pytest.raises(ConfigError, match='port: out of range: expected 0 .* to 65000, got 70000'):
        Page('a page', port=70000)


def recorded_run(path, episodes):
    return RecordedRun(path, episodes, {}, {}, {}, [], 0, 1)


def recorded_episode(name, count):
    scores = np.arange(24, dtype=np.float32)
    ring = Candidates.of([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    views = [RecordedView(
        100 * number, picture(number), orbit_camera(1.3 * number), ball(0.1 + 0.1 * number),
        None, None, 1000.0 / number,
        RecordedGoal(orbit_camera(2.0), 100 * number + 1, ring, scores, 0,
                     reason=GoalReason('shows the top', 0.1))
        if number < count else None, {})
        for number in range(1, count + 1)]
    return RecordedEpisode(name, 0, None, views, 'max_views')


@pytest.fixture
def playback(tmp_path, end):
    shown = Playback(recorded_run(
        tmp_path / 'a_bag', [recorded_episode('a', 3), recorded_episode('b', 1)]))
    yield shown
    end(shown.page)


def test_a_bag_is_stepped_through_view_by_view(playback, chromium):
    def told(words):
        chromium.until(lambda: (playback.draw(0.0), words in chromium.text())[1], words)

    opened(chromium, playback.page.url)
    told('View 1 of 3, episode 1 of 2')
    told('Next view, 115°: shows the top; expected gain of IoU 0.100.')
    first = shown(chromium, lambda: playback.draw(0.0))
    slider = chromium.driver.find_elements('css selector', '[role=slider]')[0]
    slider.send_keys('\ue014\ue014')  # arrows to the right
    told('View 3 of 3, episode 1 of 2')
    told('Done: max views.')
    shown(chromium, lambda: playback.draw(0.0),
          lambda picture: apart(first, picture) > 0.01, 'the third view')
    slider.send_keys('\ue012\ue012')
    told('View 1 of 3, episode 1 of 2')
    shown(chromium, lambda: playback.draw(0.0),
          lambda picture: apart(first, picture) < 0.003, 'the first view again')
    assert not chromium.errors()


@pytest.mark.slow
def test_a_view_that_is_typed_beyond_the_last_one_is_the_last_one(playback, chromium):
    opened(chromium, playback.page.url)
    field = chromium.driver.find_element('css selector', '.mantine-NumberInput-input')
    for typed, words in (('99', 'View 1 of 1, episode 2 of 2'),
                         ('-7', 'View 1 of 3, episode 1 of 2')):
        field.send_keys('\ue003' * 3 + typed)  # backspaces; the field is not left
        chromium.until(lambda words=words: (playback.draw(0.0), words in chromium.text())[1],
                       words)


@pytest.mark.slow
def test_a_bag_plays_to_its_end_and_then_from_the_first_view(playback, chromium):
    opened(chromium, playback.page.url)
    words = []
    for begin in (0, 100):
        chromium.run(f'(() => {{{_BUTTON}}})(arguments[0]).click()', PLAY)
        chromium.until(lambda begin=begin: (playback.draw(begin), playback.playing)[1], PLAY)
        for second in range(begin, begin + 10):
            playback.draw(float(second))
            words.append(playback.shown_text[0])
    seen = list(dict.fromkeys(words))
    assert seen == ['View 1 of 3, episode 1 of 2', 'View 2 of 3, episode 1 of 2',
                    'View 3 of 3, episode 1 of 2', 'View 1 of 1, episode 2 of 2']
    assert words[10] == seen[0]
    assert words[-1] == seen[-1]


def test_a_run_without_a_view_is_refused(tmp_path):
    with pytest.raises(DataError, match='the run has none'):
        Playback(recorded_run(tmp_path, []))


def test_a_line_of_text_is_shown_as_it_is(chromium, page):
    odd = ('Left out: <img src=x onerror="document.title=1"> ![a](/etc/hosts) *b* _c_ {1 + 1} '
           '[d](http://e) `f` & # -.jpg')
    page.set_text(['1. View <b>1</b> of **2**', odd])
    chromium.open(page.url, LAPTOP)
    chromium.until(lambda: odd in chromium.text(), 'the text as it is')
    assert '1. View <b>1</b> of **2**' in chromium.text()
    assert chromium.run('return document.querySelectorAll(arguments[0]).length',
                        'img[src="x"], a[href="http://e"]') == 0
