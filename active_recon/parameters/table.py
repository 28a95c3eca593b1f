"""
The documentation's tables of parameters, one for each node.

    python -m active_recon.parameters.table doc/interfaces.md
"""

from collections.abc import Iterator
from pathlib import Path
import sys

from active_recon.errors import DataError
from active_recon.parameters.declaration import Declared, declared, number_words
from active_recon.parameters.node_parameters import NODE_PARAMETERS

BEGIN, END = '<!-- parameters: begin -->\n', '<!-- parameters: end -->\n'
_SHOWN = 3  # elements of a list


def parameter_tables() -> str:
    """Return the parameters of every node in Markdown: a heading and a table for each."""
    return '\n'.join(
        line for node, parameters in NODE_PARAMETERS.items()
        for line in _table(node, parameters))


def with_tables(text: str) -> str:
    """Return a text with the tables between their marks; DataError where these are missing."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise DataError(f'no place for the parameter tables: expected the lines {BEGIN.strip()} '
                        f'and {END.strip()} around them, found no such lines')
    return f'{before}{BEGIN}{parameter_tables()}{END}{after}'


def _table(node: str, parameters: type) -> Iterator[str]:
    yield f'### {node}'
    yield ''
    yield '| parameter | default | allowed values | dynamic | meaning |'
    yield '|---|---|---|---|---|'
    for each in declared(parameters):
        yield (f'| `{each.name}` | {_default(each)} | {_allowed(each)} '
               f'| {"yes" if each.dynamic else ""} | {each.description} |')
    yield ''


def _default(each: Declared) -> str:
    words = each.default_words
    if not each.of:
        return words[0]
    more = ['...'] if len(words) > _SHOWN else []
    return f'`[{", ".join(words[:_SHOWN] + more)}]`'


def _allowed(each: Declared) -> str:
    if each.choices:
        return ', '.join(f'`{choice}`' for choice in each.choices)
    if each.low is not None and each.high is not None:
        return f'{number_words(each.low)} to {number_words(each.high)}'
    return ''


if __name__ == '__main__':
    path = Path(sys.argv[1])
    path.write_text(with_tables(path.read_text()))
