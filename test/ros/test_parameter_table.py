"""The documentation's parameter tables are those of the code."""

from pathlib import Path

from active_recon.errors import DataError
from active_recon.parameters.declaration import declared
from active_recon.parameters.node_parameters import NODE_PARAMETERS
from active_recon.parameters.table import BEGIN, END, parameter_tables, with_tables
import pytest

PAGE = Path(__file__).parents[2] / 'doc/interfaces.md'


def test_the_documentation_has_the_parameters_of_the_code():
    text = PAGE.read_text()
    assert with_tables(text) == text, 'python -m active_recon.parameters.table doc/interfaces.md'


def test_every_parameter_has_a_row_with_its_default():
    rows = [row.split(' | ') for row in parameter_tables().splitlines() if row.startswith('| `')]
    assert [row[0] for row in rows] == [
        f'| `{each.name}`' for settings in NODE_PARAMETERS.values() for each in declared(settings)]
    assert all(len(row) == 5 for row in rows)


def test_tables_replace_those_before_and_nothing_else():
    text = f'before\n{BEGIN}old\n{END}after\n'
    assert with_tables(text) == f'before\n{BEGIN}{parameter_tables()}{END}after\n'
    assert with_tables(with_tables(text)) == with_tables(text)


@pytest.mark.parametrize('text', ['', BEGIN, END, 'no marks'])
def test_a_text_without_the_marks_is_rejected(text):
    with pytest.raises(DataError, match='no place for the parameter tables: expected the lines'):
        with_tables(text)
