"""The README's table of parameters: `python -m active_recon.parameters.table README.md`."""

from collections.abc import Iterator
from pathlib import Path
import sys

from active_recon.errors import DataError
from active_recon.parameters.declaration import Declared, declared, number_words
from active_recon.parameters.every_node import SETTINGS

BEGIN, END = '<!-- parameters: begin -->\n', '<!-- parameters: end -->\n'
_SHOWN = 3  # elements of a list


def parameter_table() -> str:
    """Return the parameters of every node as a Markdown table."""
    return '\n'.join(_rows()) + '\n'


def with_table(text: str) -> str:
    """Return a text with the table where it belongs; DataError where its place is not marked."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise DataError(f'expected the lines {BEGIN.strip()} and {END.strip()}, between which the '
                        'table belongs; they are not there')
    return f'{before}{BEGIN}{parameter_table()}{END}{after}'


def _rows() -> Iterator[str]:
    yield '| node | parameter | default | may be | while it runs | meaning |'
    yield '|---|---|---|---|---|---|'
    for node, settings in SETTINGS.items():
        for number, each in enumerate(declared(settings)):
            yield (f'| {node if number == 0 else ""} | `{each.name}` | {_default(each)} '
                   f'| {_may_be(each)} | {"changes" if each.changeable else ""} '
                   f'| {each.description} |')


def _default(each: Declared) -> str:
    if each.of:
        shown = [str(element) for element in each.default[:_SHOWN]]
        more = ['...'] if len(each.default) > _SHOWN else []
        return f'`[{", ".join(shown + more)}]`'
    if each.kind is bool:
        return str(each.default).lower()
    return number_words(each.default) if each.kind is float else str(each.default)


def _may_be(each: Declared) -> str:
    if each.choices:
        return ', '.join(f'`{choice}`' for choice in each.choices)
    if each.low is not None and each.high is not None:
        return f'{number_words(each.low)} to {number_words(each.high)}'
    return ''


if __name__ == '__main__':
    path = Path(sys.argv[1])
    path.write_text(with_table(path.read_text()))
