"""The study of quality as text."""

from collections.abc import Iterator, Mapping
from typing import Any


def markdown(result: Mapping[str, Any]) -> str:
    """Return the figures of a study as Markdown."""
    return '\n'.join(_lines(result)) + '\n'


def _lines(result: Mapping[str, Any]) -> Iterator[str]:
    yield from ('# How well quality is judged', '', f'`{result["command"]}`', '',
                'IoU at the resolution of the network. "Solid" are objects that are not hollow: '
                'what is said of the IoU is fitted to those. Brackets are 95 % intervals.')
    for figures in result['sets']:
        yield from ('', f'## {figures["name"]}: {figures["objects"]} objects, '
                    f'{figures["hollow"]} of them hollow', '',
                    '| views | episodes | IoU | error of the expected IoU | above the lower bound '
                    '| error, with hollow | above it, with hollow | false alarms |',
                    '|---|---|---|---|---|---|---|---|')
        for count, after in figures['views'].items():
            solid, whole = after.get('solid'), after['all']
            of_solid = (f'{solid["episodes"]} | {solid["iou"]:.3f} | {_spread(solid["error"])} | '
                        f'{solid["covered"]:.3f}' if solid else '0 | – | – | –')
            yield (f'| {count} | {of_solid} | {whole["error"][0]:.3f} | {whole["covered"]:.3f} | '
                   f'{after["flagged"]:.3f} |')
        if figures['faults']:
            yield from ('', '| fault | views | episodes | flagged | named |',
                        '|---|---|---|---|---|')
        for fault, by_count in figures['faults'].items():
            for count, found in by_count.items():
                yield (f'| {fault} | {count} | {found["episodes"]} | {found["flagged"]:.2f} | '
                       f'{found["named"]:.2f} |')
        yield from ('', '| order | target | episodes | stopped | kept | kept at least '
                    '| mean views | change of IoU from five views | given up | of them wrongly |',
                    '|---|---|---|---|---|---|---|---|---|---|')
        for kind, by_target in figures['promises'].items():
            for target, found in by_target.items():
                yield (f'| {kind} | {target} | {found["episodes"]} | {found["stopped"]} | '
                       f'{_share(found["kept"])} | {_share(found["kept_at_least"])} | '
                       f'{found["views"]:.2f} | {_spread(found["change"], 4)} | '
                       f'{found["given_up"]:.2f} | {_share(found["wrongly"])} |')


def _spread(values: list[float], digits: int = 3) -> str:
    mean, low, high = values
    return f'{mean:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]'


def _share(value: float | None) -> str:
    return '–' if value is None else f'{value:.3f}'
