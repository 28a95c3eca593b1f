"""Tables in Markdown of what view policies are worth."""

from collections.abc import Mapping
from typing import Any

from active_recon.evaluation.posed.summary import table

_RIVALS = ('random', 'uniform', 'sequence')


def markdown(result: Mapping[str, Any]) -> str:
    """Return all tables of a study's result."""
    parts = ['# View policies on posed views', f'`{result["command"]}`',
             'Views are chosen on one rendering of the objects and judged on another: other '
             'light, image noise, poses off by half a degree. Means with 95 % intervals over '
             'objects and first views; differences are paired. `oracle` tries every view and '
             'takes the one after which the IoU with the truth is highest, `peeking` the one '
             'after which the network itself expects the highest IoU, `together` the best two '
             'further views of all pairs, and then as the oracle; no robot has any of them. '
             '`swapped` is the learned policy, shown the volume of an object half the set '
             'further on, `swapped_turned` of that one turned by a drawn angle, since the objects '
             'of a set face the same way. The motion takes a second a radian around either axis; '
             'NAME@COST takes its cost in IoU off.']
    if 'sequence' in result:
        offsets = ', '.join(f'{azimuth:g} at {elevation:g}'
                            for azimuth, elevation in result['sequence']['offsets_deg'])
        parts.append(f'`sequence`, found on {result["sequence"]["objects"]} objects of '
                     f'{result["sequence"]["data"]}: azimuth from the first view on and '
                     f'elevation, degrees: {offsets}.')
    return '\n\n'.join([*parts, *(part for figures in result['sets']
                                  for part in _set_tables(figures))]) + '\n'


def _set_tables(figures: Mapping[str, Any]) -> list[str]:
    policies = figures['policies']
    views = [str(view + 1) for view in range(len(next(iter(policies.values()))['iou']))]
    parts = [f'## {figures["data"]}',
             f'{figures["objects"]} objects of {figures["views"]} views, {figures["starts"]} '
             f'first view{"s" * (figures["starts"] > 1)} of each; {figures["side"]} cells a side.']
    if 'gap' in figures:
        same, repeatable = (_spread(figures['gap'][name], 4) for name in ('same', 'repeatable'))
        parts.append('The oracle is ahead of random, area under IoU, by '
                     f'{same} on the rendering that it chose on and by {repeatable} on the other: '
                     'the repeatable gap.')
    rivals = [name for name in _RIVALS if name in policies]
    rows = [[name, *(_spread(value, 3) for value in own['iou']), _spread(own['area'], 4)]
            for name, own in policies.items()]
    parts.append(table(['IoU after views', *views, 'area'], rows))
    rows = [[name, *(_spread(own['ahead'].get(rival), 4) for rival in rivals),
             _spread(own.get('share'), 2), _spread(own.get('views_for_random'), 2),
             _spread(own.get('motion_s'), 2)] for name, own in policies.items()]
    parts.append(table(['area', *(f'ahead of {name}' for name in rivals),
                        'share of the repeatable gap', 'views to where random ends',
                        'motion, s'], rows))
    return parts


def _spread(values: Mapping[str, float] | None, digits: int) -> str:
    return '-' if values is None else (
        f'{values["mean"]:.{digits}f} [{values["low"]:.{digits}f}, {values["high"]:.{digits}f}]')
