"""The report in a real browser: it is drawn, it answers, and it complains of nothing."""

from dataclasses import replace
from functools import cache
from pathlib import Path

from active_recon.policies.reasons import GoalReason
from active_recon.report.page import report_page, write_page
from active_recon.report.subject import letters, Subject
from active_recon.report.truth import known_truth
from active_recon.volumes.voxels import VoxelGrid
import numpy as np
import pytest
from report_runs import changed, recorded_run

LAPTOP, PHONE = (1280, 800), (390, 844)
pytestmark = pytest.mark.browser


@pytest.fixture(scope='module')
def pages(tmp_path_factory):
    """Return what gives the URL of a page of `one` run or of `three`."""
    folder = tmp_path_factory.mktemp('pages')

    @cache
    def url(name):
        runs = [recorded_run('chair')]
        if name == 'three':
            runs += [recorded_run('chair', 'uniform', 3), recorded_run('car')]
        path = folder / f'{name}.html'
        write_page(report_page([Subject(letter, run, run.episodes[0], known_truth(run).cells)
                                for letter, run in zip(letters(), runs, strict=False)]), path)
        return path.as_uri()

    return url


@pytest.fixture
def opened(chromium, pages):
    """Return a function that opens a page and waits until it is drawn."""
    def opened(name='one', size=LAPTOP, scheme='light', motion='reduce'):
        return drawn(chromium, pages(name), size, scheme, motion)
    return opened


def drawn(chromium, *page):
    """Open a page, and wait until it is drawn."""
    chromium.open(*page)
    chromium.until(lambda: chromium.run('return document.documentElement.dataset.ready'),
                   'the drawings')
    return chromium


@pytest.fixture
def page(one_chromium, pages):
    """
    Return the page of one run, its last view chosen, at the recorded threshold.

    It takes seconds to be drawn, so that it is left open for the next test.
    """
    if one_chromium.driver.current_url != pages('one'):
        drawn(one_chromium, pages('one'), LAPTOP)
    one_chromium.run('document.querySelector(`.after input[value="4"]`).click()')
    slide(one_chromium, None)
    return one_chromium


def slide(page, threshold):
    """Move the threshold, where it was at first if None."""
    page.run('const slider = document.querySelector("input[type=range]");'
             'slider.value = arguments[0] ?? slider.defaultValue;'
             'slider.dispatchEvent(new Event("input", {bubbles: true}))', threshold)


def button(page):
    return page.run('return document.querySelector(".turn").textContent')


def shape(page):
    """Return the first 3D view as it is seen."""
    page.run('document.querySelector(".scene").scrollIntoView()')
    page.driver.execute_async_script(  # two frames: what was asked for has been drawn
        'requestAnimationFrame(() => requestAnimationFrame(arguments[0]))')
    left, top, width, height = page.run(
        'const box = document.querySelector(".scene").getBoundingClientRect();'
        'return [box.left, box.top, box.width, box.height].map(Math.round)')
    return page.picture()[max(top, 0):top + height, left:left + width]


def cells(page):
    return int(page.run('return document.querySelector(".count").textContent').split()[0])


@pytest.mark.parametrize(('name', 'size', 'scheme'), [
    ('one', PHONE, 'dark'), *(pytest.param(*rest, marks=pytest.mark.slow) for rest in (
        ('one', LAPTOP, 'light'), ('one', LAPTOP, 'dark'), ('one', PHONE, 'light'),
        ('three', LAPTOP, 'light'), ('three', LAPTOP, 'dark'), ('three', PHONE, 'light'),
        ('three', PHONE, 'dark')))])
def test_page_is_drawn_without_complaint_and_fits_its_window(opened, name, size, scheme):
    page = opened(name, size, scheme)
    picture = shape(page).astype(int)
    blue = picture[..., 2] - picture[..., 0]
    assert (blue > 40).mean() > 0.02  # the object, amid grey
    drawn = page.run('return [...document.querySelectorAll(".chart, .map")].map((each) => '
                     'each.querySelectorAll("path, image").length)')
    assert min(drawn) > 3
    assert page.run('return document.documentElement.scrollWidth') <= size[0]
    assert page.run('return document.getElementById("trouble").hidden')
    assert page.errors() == []


@pytest.mark.slow
@pytest.mark.parametrize('count', [1, 2])
def test_long_names_make_the_page_no_wider_than_a_phone(chromium, tmp_path, count):
    run, name = recorded_run('chair', views=2), 'name' * 40
    first, last = run.episodes[0].views
    first = replace(first, goal=replace(first.goal, reason=GoalReason(name)))
    run = replace(changed(run, views=[first, last], id=name, done=name), path=Path(name),
                  provenance={'object': name, 'policy': f'{name}:{name}', name: name},
                  parameters={name: {name: name}}, counters={name: {f'refused/{name}': 3}})
    write_page(report_page([Subject(letter, run, run.episodes[0])
                            for letter in 'AB'[:count]]), tmp_path / 'page.html')
    chromium.open((tmp_path / 'page.html').as_uri(), PHONE)
    chromium.run('for (const each of document.querySelectorAll("details")) each.open = true')
    assert chromium.run('return document.documentElement.scrollWidth') <= PHONE[0]


@pytest.mark.slow
@pytest.mark.parametrize('name', ['one', 'three'])
def test_no_figure_of_the_timing_table_is_cut_off_on_a_phone(opened, name):
    page = opened(name, PHONE)
    inside = page.run(
        'return [...document.querySelectorAll(".timing")].map((table) => '
        '[table.scrollWidth, table.parentElement.clientWidth, '
        'Math.max(...[...table.querySelectorAll("td")].map((cell) => '
        'cell.getBoundingClientRect().right)), '
        'table.parentElement.getBoundingClientRect().right])')
    assert inside
    for wide, room, right, edge in inside:
        assert wide <= room
        assert right <= edge + 1


def test_another_view_shows_another_shape_and_what_was_thought_then(page, changed_share):
    seen = []
    for chosen in ('4', '0', 'truth'):  # the last view, the first, and the truth
        page.run('document.querySelector(`.after input[value="${arguments[0]}"]`).click()', chosen)
        goal = page.run('return document.querySelector(".map").data.find((trace) => '
                        'trace.meta && trace.marker?.symbol === "diamond-open").hovertemplate')
        seen.append((shape(page), cells(page), goal))
    (last, last_cells, last_goal), (first, first_cells, first_goal), (true, true_cells, _) = seen
    assert changed_share(last, first) > 0.01
    assert changed_share(first, true) > 0.01
    assert len({last_cells, first_cells, true_cells}) == 3
    assert last_goal != first_goal


@pytest.mark.slow
def test_page_turns_dark_with_its_reader(opened, changed_share):
    page = opened()
    light = shape(page)
    page.prefer('dark')
    page.until(lambda: changed_share(light, shape(page)) > 0.9, 'the dark')
    ink = page.run('return [document.body, document.querySelector(".chart .xtick text")].map('
                   '(each) => getComputedStyle(each)[each === document.body ? "color" : "fill"])')
    assert ink[0] == ink[1] == 'rgb(230, 231, 234)'


def test_choosing_an_image_chooses_its_view(page):
    page.run('document.querySelectorAll(".film label")[1].click()')
    assert page.run('return document.querySelector(".after input:checked").value') == '1'
    assert page.run('return [...document.querySelectorAll(".film li")].findIndex((item) => '
                    'item.classList.contains("chosen"))') == 1


def test_higher_threshold_leaves_fewer_cells(page, changed_share):
    before, counts = shape(page), []
    for threshold in (0.1, 0.3, 0.6, 0.9):
        slide(page, threshold)
        counts.append(cells(page))
        assert page.run('return document.querySelector("output").textContent') == (
            f'{threshold:.2f}')
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] < counts[0]
    assert changed_share(before, shape(page)) > 0.01


@pytest.mark.slow
def test_at_the_recorded_threshold_just_the_recorded_cells_are_drawn(opened):
    recorded = recorded_run('chair').episodes[0].views[-1].occupied
    assert cells(opened()) == recorded.occupied(0).sum()


@pytest.mark.slow
def test_a_recorded_threshold_beyond_the_slider_holds_until_it_is_moved(chromium, tmp_path):
    run = recorded_run('car', views=1)
    [view] = run.episodes[0].views
    sure = VoxelGrid(np.where(view.reconstruction.occupied(0.985), 1, 0).astype(np.float32))
    run = changed(run, views=[replace(view, occupied=sure)])
    write_page(report_page([Subject('A', run, run.episodes[0])]), tmp_path / 'page.html')
    page = drawn(chromium, (tmp_path / 'page.html').as_uri())
    assert cells(page) == sure.occupied(0).sum() > 0
    slide(page, 0.5)
    assert cells(page) == view.reconstruction.occupied(0.5).sum()


@pytest.mark.slow
def test_object_turns_until_it_is_paused(opened, changed_share):
    page = opened(motion='no-preference')
    assert button(page) == 'Pause'
    page.run('document.querySelector(".turn").click()')
    assert button(page) == 'Turn'
    before = shape(page)
    assert changed_share(before, shape(page)) < 0.001
    page.run('document.querySelector(".turn").click()')
    assert button(page) == 'Pause'
    page.until(lambda: changed_share(before, shape(page)) > 0.02, 'the object to turn')
    assert page.errors() == []


def test_who_hears_the_page_is_not_told_that_the_shape_turns_while_it_stands(page):
    said = page.run('const turn = document.querySelector(".turn"); turn.click(); turn.click();'
                    'return [turn.textContent, turn.ariaPressed, document.querySelector('
                    '".scene").ariaLabel]')
    assert said == ['Turn', None, 'The reconstructed shape in 3D']  # a label, or a state


def test_the_surface_in_its_colours_is_drawn(page, changed_share):
    before = shape(page)
    page.run('document.querySelector(".after input[value=colors]").click()')
    page.until(lambda: 'in the colours' in page.run(
        'return document.querySelector(".count").textContent'), 'the coloured surface')
    assert changed_share(before, shape(page)) > 0.01
    page.run('document.querySelector(".after input").click()')
    assert cells(page) > 0


@pytest.mark.slow
def test_object_stands_still_for_who_prefers_less_motion(opened, changed_share):
    page = opened()
    assert button(page) == 'Turn'
    before = shape(page)
    assert changed_share(before, shape(page)) < 0.001
