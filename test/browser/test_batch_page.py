"""The page of an archive in a real browser."""

from active_recon.batch.rows import COLUMNS, refusal_row
from active_recon.batch.summary import Summary
import pytest

pytestmark = pytest.mark.browser
BARS = 'return document.querySelectorAll("[data-chart] .bars path").length'


def opened(chromium, folder, *rows, **look):
    """Open the page of some rows, and wait for its charts."""
    summary = Summary()
    assert list(summary.counting(rows)) == list(rows)
    summary.write(folder / 'page.html', 'measure')
    chromium.open((folder / 'page.html').as_uri(), **look)
    chromium.until(lambda: chromium.run(BARS), 'the charts')


def test_the_charts_are_drawn_without_complaint(chromium, tmp_path):
    opened(chromium, tmp_path, *(refusal_row(f'{number}.mcap', 'damaged', kind)
                                 for number, kind in enumerate(('data', 'data', 'version'))))
    assert chromium.run(BARS) == 2
    assert chromium.run('return document.querySelector("[data-chart]").ariaLabel') == (
        'Counts, why it was refused')
    assert chromium.errors() == []


def test_a_bar_under_the_pointer_tells_of_which_values_it_is_the_count(chromium, tmp_path):
    row = {**dict.fromkeys(COLUMNS), 'bag': '1.mcap', 'refused': '', 'verdict': '', 'views': 4,
           'stopped': 'gain_too_small', 'warnings': [], 'expected_iou': 0.93, 'iou': 0.5}
    opened(chromium, tmp_path, row)
    told = {}
    for name in ('expected IoU', 'IoU with the truth', 'views'):
        chromium.run("""
            const place = [...document.querySelectorAll('[data-chart]')].find(
              (each) => each.dataset.chart === arguments[0]);
            const pointNumber = place.data[0].y.indexOf(1);
            Plotly.Fx.hover(place, [{ curveNumber: 0, pointNumber }]);""", name)
        told[name] = chromium.until(lambda: chromium.run(
            'return document.querySelector(`[data-chart="${arguments[0]}"] .hovertext .nums`)'
            '?.textContent', name), f'what is told of {name}', 5)  # noqa: B023
    assert told == {'expected IoU': '0.90 to 0.95: 1 episode',
                    'IoU with the truth': '0.50 to 0.55: 1 episode', 'views': '4: 1 episode'}


def test_the_page_fits_the_narrowest_window(chromium, tmp_path):
    opened(chromium, tmp_path, refusal_row(f'{"long" * 60}.mcap', 'damaged', 'data'),
           size=(320, 640))
    assert chromium.run('return document.documentElement.scrollWidth') <= 320


@pytest.mark.slow
def test_the_charts_turn_dark_with_their_reader(chromium, tmp_path):
    opened(chromium, tmp_path, refusal_row('1.mcap', 'damaged', 'data'))
    ink, words = (f'return getComputedStyle(document.querySelector("{of}")).{what}'
                  for of, what in (('body', 'color'), ('[data-chart] .xtick text', 'fill')))
    light = chromium.run(words)
    assert light == chromium.run(ink)
    chromium.prefer('dark')
    chromium.until(lambda: chromium.run(words) == chromium.run(ink) != light, 'the other ink')


@pytest.mark.slow
def test_the_grids_of_the_charts_stand_back_in_light_and_dark(chromium, tmp_path):
    opened(chromium, tmp_path, refusal_row('1.mcap', 'damaged', 'data'))
    for scheme in ('light', 'dark'):
        chromium.prefer(scheme)
        chromium.until(lambda: chromium.run(
            'const colour = (of, what) => getComputedStyle(document.querySelector(of))[what]'
            '.match(/\\d+/g).slice(0, 3).reduce((sum, each) => sum + Number(each), 0);'
            'const paper = colour("body", "backgroundColor");'
            'const away = (each) => Math.abs(each - paper);'
            'return 3 * away(colour(".ygrid", "stroke")) < away(colour(".xtick text", "fill"))'),
            f'a quiet grid in {scheme}', 5)
