"""The README's table of parameters is that of the code."""

from pathlib import Path

from active_recon.errors import DataError
from active_recon.parameters.declaration import declared
from active_recon.parameters.every_node import SETTINGS
from active_recon.parameters.table import BEGIN, END, parameter_table, with_table
import pytest

README = Path(__file__).parents[2] / 'README.md'


def test_the_readme_tells_the_parameters_of_the_code():
    text = README.read_text()
    assert with_table(text) == text, 'python -m active_recon.parameters.table README.md'


def test_every_parameter_has_a_row_with_its_default():
    rows = [row.split(' | ') for row in parameter_table().splitlines()[2:]]
    assert [row[1] for row in rows] == [
        f'`{each.name}`' for settings in SETTINGS.values() for each in declared(settings)]
    assert all(len(row) == 6 for row in rows)


def test_a_table_replaces_the_one_before_and_nothing_else():
    text = f'before\n{BEGIN}old\n{END}after\n'
    assert with_table(text) == f'before\n{BEGIN}{parameter_table()}{END}after\n'
    assert with_table(with_table(text)) == with_table(text)


@pytest.mark.parametrize('text', ['', BEGIN, END, 'no marks'])
def test_a_text_without_a_place_for_the_table_is_refused(text):
    with pytest.raises(DataError, match='expected the lines'):
        with_table(text)
