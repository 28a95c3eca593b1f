"""The table of the page on photos is that of the measured results."""

import json
from pathlib import Path

from benchmarks.photos import with_table

ROOT = Path(__file__).parents[1]


def test_the_page_shows_the_figures_that_were_measured():
    result = json.loads((ROOT / 'docs/results/photos.json').read_text())
    text = (ROOT / 'doc/photos.md').read_text()
    assert with_table(text, result) == text
    result['photographs']['auto'][0] = 0.123
    assert '0.123' in with_table(text, result)
