"""
What choosing views is worth: the studies of the default's view policy, and their tables.

`python -m benchmarks.views FOLDER [STUDY ...]` runs them on the data in a folder (doc/results.md
lists the commands that make it); `python -m benchmarks.views` only updates the tables.
"""

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
from typing import Any

from active_recon.models.weights_files import SMALL_MODEL
from benchmarks.studies import chosen_studies, run_study, with_tables_between_marks

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs' / 'results' / 'views'
DOCUMENTS = (ROOT / 'README.md', ROOT / 'doc' / 'results.md')
_SETS = {'test': 'parametric test', 'unseen': 'categories never trained on', 'real': 'real models'}
_DATA = {'test': 'test', 'unseen': 'unseen', 'real': 'real_val'}
_HOW = '--starts 1 --seeds 2 --threads 1 --runtime openvino'
_SIXTY = f'--objects 60 {_HOW}'
_OF_SMALL = f'--model {SMALL_MODEL}'
_SWAPPED = 'random,attention,swapped,swapped_turned'
_AROUND = 'random,uniform,farthest,unseen_entropy,rendered_uncertainty'
_ON_DOME = 'random,uniform,farthest,unseen_entropy'
_COUNTS = (1, 2, 3, 5)
_PLACES = {'turntable': 'turntable', 'dome': 'dome, as of an arm'}


def _studies() -> Iterator[tuple[str, str]]:
    """Yield the name of each study of the default and the arguments of `active-recon policies`."""
    yield 'turntable-validation-cost', (
        'turn/val --policies random,uniform,attention,'
        f'{_by_cost("0.005", "0.01", "0.015", "0.02", "0.03")} {_SIXTY}')
    for name, data in _DATA.items():
        yield f'turntable-{name}-learned', f'data/{data} {_LEARNED}'
        yield f'turntable-{name}-swapped', f'data/{data} --policies {_SWAPPED} {_SIXTY}'
        yield f'dome-{name}-learned', (
            f'dome/{data} --policies {_ON_DOME},attention,oracle {_SIXTY}')
        yield f'dome-{name}-swapped', f'dome/{data} --policies {_SWAPPED} {_SIXTY}'
    for cameras, folder in (('turntable', 'data'), ('dome', 'dome')):
        yield f'{cameras}-real-all', (
            f'{folder}/real_val --policies random,uniform,attention --objects 347 {_HOW}')


def _studies_of_small() -> Iterator[tuple[str, str]]:
    """Yield the same of the small network."""
    yield 'turntable-validation', (
        'turn/val --policies random,uniform,farthest,attention,'
        + _by_cost('0.03', '0.035', '0.04', '0.045', '0.05') + f' {_SIXTY}')
    for name, data in _DATA.items():
        yield f'turntable-{name}-learned', f'data/{data} {_LEARNED}'
        yield f'turntable-{name}-peeking', (
            f'data/{data} --policies random,uniform,attention,peeking,oracle {_SIXTY}')
        yield f'dome-{name}-learned', (
            f'dome/{data} --policies {_ON_DOME},attention,oracle {_SIXTY}')
    for name in ('unseen', 'real'):
        yield f'turntable-{name}-sequence', (
            f'data/{_DATA[name]} --policies random,uniform,sequence,attention '
            f'--training turn/train --training-objects 60 {_SIXTY}')
    yield 'turntable-unseen-together', (
        'data/unseen --policies random,uniform,attention,oracle,together --views 3 --objects 12 '
        f'{_HOW}')


def _by_cost(*costs: str) -> str:
    return ','.join(f'attention@{cost}' for cost in costs)


_LEARNED = (f'--policies {_AROUND},attention,'
            f'{_by_cost("0.01", "0.02", "0.03", "0.035", "0.04")},oracle {_SIXTY}')
STUDIES: Mapping[str, str] = {
    **dict(_studies()),
    **{f'small-{name}': f'{how} {_OF_SMALL}' for name, how in _studies_of_small()}}


def with_tables(text: str) -> str:
    """Return the document with the tables between their marks."""
    return with_tables_between_marks(text, {
        'views': views_table, 'views-small': small_table, 'views-short': short_table,
        'swapped': swapped_table})


def short_table() -> Iterator[str]:
    """Yield the lines of the table of the sweep and the learned policy."""
    yield '| objects | cameras | even sweep | learned view policy | ahead of the sweep, IoU |'
    yield '|---|---|---|---|---|'
    for cameras, told in _PLACES.items():
        for name, objects in _SETS.items():
            found = policies_of(f'{cameras}-{name}-learned')
            yield (f'| {objects} (60) | {told} | {_share(found["uniform"])} | '
                   f'{_share(found["attention"])} | '
                   f'{_interval(found["attention"]["ahead"]["uniform"])} |')
        if f'{cameras}-real-all' in STUDIES:
            ahead = policies_of(f'{cameras}-real-all')['attention']['ahead']['uniform']
            yield f'| all real models (347) | {told} | | | {_interval(ahead)} |'


def views_table() -> Iterator[str]:
    """Yield the lines of the table of all policies but those that count motion."""
    yield from _table('')


def small_table() -> Iterator[str]:
    """Yield the same with the small network."""
    yield from _table('small-')


def _table(prefix: str) -> Iterator[str]:
    yield ('| objects (60 each) | policy | 1 view | 2 | 3 | 5 views | ahead of random '
           '| ahead of the sweep | share of the gap |')
    yield '|---|---|---|---|---|---|---|---|---|'
    for cameras in _PLACES:
        for name, objects in _SETS.items():
            study = f'{prefix}{cameras}-{name}'
            found = policies_of(f'{study}-learned')
            if f'{study}-sequence' in STUDIES:
                found['sequence'] = policies_of(f'{study}-sequence')['sequence']
            shown = [policy for policy in (*_AROUND.split(','), 'sequence', 'attention', 'oracle')
                     if policy in found]
            for policy in shown:
                yield _row(f'{cameras}, {objects}' if policy == shown[0] else '', policy,
                           found[policy])


def swapped_table() -> Iterator[str]:
    """Yield the lines of the table of what another object's volume costs, indented for a list."""
    yield '  | objects | another object | another object, turned |'
    yield '  |---|---|---|'
    for cameras in _PLACES:
        for name, objects in _SETS.items():
            study = f'{cameras}-{name}-swapped'
            ahead = policies_of(study)['attention']['ahead']
            cells = (f'{_interval(ahead[policy])}, '
                     f'{100 * ahead[policy]["mean"] / ahead["random"]["mean"]:.0f} %'
                     for policy in ('swapped', 'swapped_turned'))
            yield (f'  | [{cameras}, {objects}](../docs/results/views/{study}.md) | '
                   f'{" | ".join(cells)} |')


def _row(objects: str, policy: str, found: Mapping[str, Any]) -> str:
    means = (f'{found["iou"][count - 1]["mean"]:.3f}' for count in _COUNTS)
    ahead = ('' if policy == other else _interval(found['ahead'][other])
             for other in ('random', 'uniform'))
    told = '' if 'share' not in found or policy in ('random', 'oracle') else _share(found)
    return f'| {objects} | `{policy}` | {" | ".join((*means, *ahead, told))} |'


def _share(found: Mapping[str, Any]) -> str:
    share = found['share']
    return f'{100 * share["mean"]:.0f} % [{100 * share["low"]:.0f}, {100 * share["high"]:.0f}]'


def policies_of(study: str) -> dict[str, Any]:
    """Return what a study measured of each policy on its set, by the policies' names."""
    sets = json.loads((RESULTS / f'{study}.json').read_text())['sets']
    return dict(sets[0]['policies'])


def _interval(value: Mapping[str, float]) -> str:
    return f'{value["mean"]:.3f} [{value["low"]:.3f}, {value["high"]:.3f}]'


def main() -> None:
    """Run the studies named, or all, where a folder is given; then write the tables."""
    folder, names = chosen_studies(STUDIES)
    for name in names:
        run_study('policies', STUDIES[name], 'policies', folder, RESULTS / name)
    for path in DOCUMENTS:
        path.write_text(with_tables(path.read_text()))


if __name__ == '__main__':
    main()
