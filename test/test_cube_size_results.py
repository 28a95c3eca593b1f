"""The table of how wide a cube may be is that of the measured results."""

import json
from pathlib import Path

from active_recon.models.weights_files import DEFAULT_MODEL, find_weights, weights_hash
from benchmarks.cube_sizes import with_table

ROOT = Path(__file__).parents[1]
RESULT = ROOT / 'docs/results/cube-sizes.json'


def test_the_page_shows_the_figures_that_were_measured():
    result, text = json.loads(RESULT.read_text()), (ROOT / 'doc/results.md').read_text()
    assert result['weights_sha256'] == weights_hash(find_weights(DEFAULT_MODEL))
    assert with_table(text, result) == text
    result['cases'][0]['iou'] = 0.123
    assert '0.123' in with_table(text, result)


def test_no_other_cube_is_told_to_fit_objects_that_fill_theirs():
    for case in json.loads(RESULT.read_text())['cases']:
        if case['side'] <= 1.1 and case['place'] == 'middle':
            assert case['told'] <= 0.05, case
