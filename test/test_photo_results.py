"""The table of the page on photos is that of the measured results."""

import json
from pathlib import Path

from active_recon.models.weights_files import DEFAULT_MODEL, find_weights, SMALL_MODEL
from benchmarks import photos_alone
from benchmarks.photos import with_table
import numpy as np

ROOT = Path(__file__).parents[1]


def measured(name='photos'):
    return json.loads((ROOT / f'docs/results/{name}.json').read_text())


def test_the_page_shows_the_figures_that_were_measured():
    result, faster = measured(), measured(f'photos-{SMALL_MODEL}')
    text = (ROOT / 'doc/photos.md').read_text()
    assert with_table(text, result, faster) == text
    result['photographs']['auto'][0] = 0.123
    assert '0.123' in with_table(text, result, faster)


def test_the_page_shows_what_was_measured_of_photos_alone():
    result, text = measured('photos-alone'), (ROOT / 'doc/photos.md').read_text()
    assert photos_alone.with_table(text, result) == text
    result['iou']['mean'] = 0.123
    assert '0.123' in photos_alone.with_table(text, result)


def test_the_network_of_photos_ships_and_is_ahead_of_the_faster_one():
    assert find_weights(DEFAULT_MODEL).is_file()
    result, faster = measured(), measured(f'photos-{SMALL_MODEL}')
    for way in ('auto', 'plain'):  # the dinosaur before black is behind by `network`, as is told
        ahead = np.subtract(result['photographs'][way], faster['photographs'][way])
        assert ahead.mean() > 0, way
    for part in ('rendered', 'board', 'phone', 'table'):
        for way, figure in result[part]['iou'].items():
            assert figure['mean'] > faster[part]['iou'][way]['mean'], (part, way)


def test_tables_that_were_found_are_where_they_are_and_most_with_a_texture_were():
    for kind, patterns in measured()['grounds'].items():
        errors = [error for errors in patterns.values() for error in errors if error is not None]
        assert max(errors) < 0.04, kind
        for pattern in ('boards', 'fine'):
            missed = [error is None for error in patterns[pattern]]
            assert np.mean(missed) <= 0.1, (kind, pattern)
