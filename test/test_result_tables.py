"""The tables of the documents are those of the measured results."""

import json

from active_recon.models.weights_files import (
    DEFAULT_MODEL,
    find_weights,
    PAPER_MODEL,
    weights_hash,
)
from benchmarks import views
from benchmarks.lifting import DOCUMENTS, figures_by_set, ROOT, with_tables
import pytest


@pytest.mark.parametrize('path', DOCUMENTS, ids=lambda path: path.name)
def test_a_document_shows_the_figures_that_were_measured(path):
    text = path.read_text()
    assert with_tables(text) == text


def test_a_table_that_was_changed_by_hand_is_mended():
    text = DOCUMENTS[0].read_text()
    _, models = next(figures_by_set())
    figure = f'{models[DEFAULT_MODEL][1]["mean"]:.3f}'
    assert figure in text
    assert with_tables(text.replace(figure, '0.999')) == text


@pytest.mark.parametrize(('path', 'table'), [
    (views.DOCUMENTS[0], views.short_table), (views.DOCUMENTS[1], views.views_table),
    (views.DOCUMENTS[1], views.small_table)])
def test_a_table_of_view_policies_is_of_what_was_measured(path, table):
    text = path.read_text()
    assert views.with_tables(text) == text
    row = list(table())[-1]
    assert row in text and views.with_tables(text.replace(row, '|')) == text


@pytest.mark.parametrize('name', views.STUDIES)
def test_a_study_of_view_policies_was_run_as_it_is_listed(name):
    ran = json.loads((views.RESULTS / f'{name}.json').read_text())['command'].split()
    assert sorted(ran[2:]) == sorted([*views.STUDIES[name].split(), '--out', f'build/{name}'])


@pytest.mark.parametrize('path', sorted((ROOT / 'docs' / 'results').rglob('*.json')),
                         ids=lambda path: str(path.relative_to(ROOT / 'docs' / 'results')))
def test_a_result_of_one_network_was_measured_with_the_one_that_its_command_means(path):
    found = json.loads(path.read_text())
    words = found['command'].split()
    usual = PAPER_MODEL if words[:2] == ['active-recon', 'evaluate'] else DEFAULT_MODEL
    meant = words[words.index('--model') + 1] if '--model' in words else usual
    if digest := found.get('weights_sha256') or found.get('weights'):
        assert digest == weights_hash(find_weights(meant))
    assert found.get('model', meant) == meant
