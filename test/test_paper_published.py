"""The paper's printed figures have the paper's shape."""

import json
from pathlib import Path

from active_recon.evaluation.statistics import Interval
from active_recon.paper import published, table2
from active_recon.paper.results import Column
from active_recon.shapes import CATEGORIES, UNSEEN_CATEGORIES
import pytest


def test_table_1_has_loss_and_iou_at_five_views_with_and_without_attention():
    assert list(published.TABLE1) == ['2D-3D', '2D-3D-attention']
    for figures in published.TABLE1.values():
        assert len(figures['loss']) == len(figures['iou']) == len(published.VIEWS) == 5
        assert sorted(figures['iou']) == list(figures['iou'])
        assert sorted(figures['loss'], reverse=True) == list(figures['loss'])
    gain = published.TABLE1['2D-3D-attention']['iou'][0] - published.TABLE1['2D-3D']['iou'][0]
    assert gain == pytest.approx(0.063)


def test_table_2_has_seven_pairs_that_sum_to_one():
    assert len(published.TABLE2) == 7
    assert all(sum(pair) == pytest.approx(1) for pair in published.TABLE2)
    assert max(published.TABLE2, key=lambda pair: published.TABLE2[pair][1]) == (0.4, 0.6)
    assert all(training > test for training, test in published.TABLE2.values())


def test_table_3_has_the_thirteen_categories_and_four_systems():
    assert set(published.TABLE3) == set(CATEGORIES)
    assert len(published.TABLE3) == 13
    assert {len(row) for row in published.TABLE3.values()} == {len(published.TABLE3_SYSTEMS)}
    best = [row[3] == max(row) for row in published.TABLE3.values()]
    assert sum(best) == 10  # all but chair, car and watercraft


def test_table_4_sums_to_its_total_and_to_a_hundred_percent():
    seconds, percent = zip(*published.TABLE4.values(), strict=True)
    assert sum(seconds) == pytest.approx(published.TABLE4_TOTAL)
    assert sum(percent) == pytest.approx(100)
    for value, share in published.TABLE4.values():
        assert 100 * value / published.TABLE4_TOTAL == pytest.approx(share, abs=0.02)


def test_table_5_has_the_unseen_categories_at_three_counts_of_views():
    assert set(published.TABLE5) == set(UNSEEN_CATEGORIES)
    for row in published.TABLE5.values():
        assert len(row) == len(published.TABLE5_VIEWS)
        assert sorted(row) == list(row)


@pytest.mark.parametrize(('part', 'dataset'), [
    ('table1', 'ShapeNet'), ('table2', 'PASCAL3D+'), ('table3', 'ShapeNet'),
    ('table5', 'PASCAL3D+')])
def test_printed_figures_stand_under_the_dataset_that_the_paper_names(part, dataset):
    results = Path(__file__).parents[1] / 'docs' / 'results' / f'{part}.json'
    headings = [column['heading'] for table in json.loads(results.read_text())['tables']
                for column in table['columns'] if column['published']]
    assert headings
    assert all(heading.startswith(f'published, {dataset}: ') for heading in headings)


def test_a_column_of_printed_figures_names_their_dataset():
    assert Column('1', [0.3], published=True, of='PASCAL3D+').title == 'published, PASCAL3D+: 1'
    rows = {str(pair): (Interval(0.5, 0.4, 0.6),) * 2 for pair in published.TABLE2}
    assert 'published, PASCAL3D+: test' in table2._table(rows).markdown()
