"""The tables of the documents are those of the measured results."""

from benchmarks.lifting import DOCUMENTS, figures_by_set, with_tables
import pytest


@pytest.mark.parametrize('path', DOCUMENTS, ids=lambda path: path.name)
def test_a_document_shows_the_figures_that_were_measured(path):
    text = path.read_text()
    assert with_tables(text) == text


def test_a_table_that_was_changed_by_hand_is_mended():
    text = DOCUMENTS[0].read_text()
    _, models = next(figures_by_set())
    figure = f'{models["lifting"][1]["mean"]:.3f}'
    assert figure in text
    assert with_tables(text.replace(figure, '0.999')) == text
