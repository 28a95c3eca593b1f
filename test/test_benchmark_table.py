"""The table of doc/benchmarks.md is that of what was measured."""

import json

from benchmarks.__main__ import BY_THEMSELVES, PARTS
from benchmarks.figures import Figure
from benchmarks.record import DOCUMENT, part_record, RESULTS, rows, with_table
from benchmarks.stream import counting_lost
import pytest


def cells(figure):
    return [cell.strip() for cell in next(rows(part_record([figure], 2.0))).split('|')[1:-1]]


def test_the_document_shows_what_was_measured_last():
    text, parts = DOCUMENT.read_text(), json.loads(RESULTS.read_text())['parts']
    assert with_table(text, parts, BY_THEMSELVES) == text
    assert parts.keys() <= PARTS.keys()
    assert all(figure['name'] in text for part in parts.values() for figure in part['figures'])


@pytest.mark.parametrize(('samples', 'goal', 'more', 'words'), [
    ([3.0], 4, False, 'at most 4 ms'), ([5.0], 4, False, 'at most 4 ms: missed'),
    ([5.0], 4, True, 'at least 4 ms'), ([3.0], 4, True, 'at least 4 ms: missed'),
    ([3.0], None, False, '')])
def test_a_goal_that_is_not_reached_is_called_missed(samples, goal, more, words):
    assert cells(Figure('a view', 'ms', samples, goal, more_is_better=more))[3] == words


def test_times_are_told_as_multiples_of_the_reference_and_nothing_else_is():
    assert cells(Figure('a view', 'ms', [5.0], None))[4] == '2.5'
    assert cells(Figure('a start', 's', [5.0], None))[4] == '2500.0'
    assert cells(Figure('memory', 'MB', [5.0], None))[4] == ''


def test_images_that_were_lost_are_among_the_slowest():
    some = Figure('p99', 'ms', counting_lost([0.01] * 147 + [0.0] * 3), 60, percentile=99)
    assert some.value == 1000 and not some.reached
