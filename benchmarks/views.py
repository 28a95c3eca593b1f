"""
What choosing views is worth: the studies of the default's view policy, and their tables.

`python -m benchmarks.views FOLDER [STUDY ...]` runs them on the data in a folder (doc/results.md
lists the commands that make it); `python -m benchmarks.views` only updates the tables.
"""

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
from typing import Any

from benchmarks.studies import chosen_studies, run_study, with_tables_between_marks

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs' / 'results' / 'views'
DOCUMENTS = (ROOT / 'README.md', ROOT / 'doc' / 'results.md')
_SETS = {'test': 'parametric test', 'unseen': 'categories never trained on', 'real': 'real models'}
_DATA = {'test': 'test', 'unseen': 'unseen', 'real': 'real_val'}
_FOLDERS = {'turntable': 'data', 'dome': 'dome'}
_HOW = '--starts 1 --seeds 2 --threads 1 --runtime openvino'
_SWAPPED = 'random,attention,swapped,swapped_turned'
_PLAIN = {
    'turntable': 'random,uniform,farthest,unseen_entropy,rendered_uncertainty',
    'dome': 'random,uniform,farthest,unseen_entropy',
}
_ON_TRAINING = '--training turn/train --training-objects'
_COUNTS = (1, 2, 3, 5)


def _studies() -> Iterator[tuple[str, str]]:
    """Yield the name of each study and the arguments of `active-recon policies`."""
    sixty = f'--objects 60 {_HOW}'
    yield 'turntable-validation', (
        'turn/val --policies random,uniform,farthest,attention,'
        + _by_cost('0.03', '0.035', '0.04', '0.045', '0.05') + f' {_ON_TRAINING} 8 {sixty}')
    yield 'turntable-validation-cost', (
        f'turn/val --policies random,uniform,{_by_cost("0.05", "0.06", "0.07", "0.08", "0.1")} '
        f'{sixty}')
    for cameras, folder in _FOLDERS.items():
        for name, data in _DATA.items():
            learned = 'attention' if cameras == 'dome' else (
                f'attention,{_by_cost("0.01", "0.02", "0.03", "0.035", "0.04")}')
            yield f'{cameras}-{name}-learned', (
                f'{folder}/{data} --policies {_PLAIN[cameras]},{learned},oracle {sixty}')
            yield f'{cameras}-{name}-swapped', f'{folder}/{data} --policies {_SWAPPED} {sixty}'
    for name, data in _DATA.items():
        yield f'turntable-{name}-cost', (
            f'data/{data} --policies random,uniform,{_by_cost("0.05", "0.06")} {sixty}')
        yield f'turntable-{name}-peeking', (
            f'data/{data} --policies random,uniform,attention,peeking,oracle {sixty}')
    for name in ('unseen', 'real'):
        yield f'turntable-{name}-sequence', (
            f'data/{_DATA[name]} --policies random,uniform,sequence,attention '
            f'{_ON_TRAINING} 60 {sixty}')
    yield 'turntable-unseen-together', (
        'data/unseen --policies random,uniform,attention,oracle,together --views 3 --objects 12 '
        f'{_HOW}')
    yield 'turntable-real-all', (
        f'data/real_val --policies random,uniform,attention --objects 347 {_HOW}')


def _by_cost(*costs: str) -> str:
    return ','.join(f'attention@{cost}' for cost in costs)


STUDIES: Mapping[str, str] = dict(_studies())


def with_tables(text: str) -> str:
    """Return the document with the tables between their marks."""
    return with_tables_between_marks(text, {
        'views': views_table, 'swapped': swapped_table, 'views-short': short_table})


def short_table() -> Iterator[str]:
    """Yield the lines of the table of the sweep and the learned policy on a turntable."""
    yield '| objects | even sweep | learned view policy | ahead of the sweep, IoU |'
    yield '|---|---|---|---|'
    for name, objects in _SETS.items():
        found = policies_of(f'turntable-{name}-learned')
        yield (f'| {objects} (60) | {_share(found["uniform"])} | {_share(found["attention"])} | '
               f'{_interval(found["attention"]["ahead"]["uniform"])} |')
    ahead = policies_of('turntable-real-all')['attention']['ahead']['uniform']
    yield f'| all real models (347) | | | {_interval(ahead)} |'


def views_table() -> Iterator[str]:
    """Yield the lines of the table of all policies but those that count motion."""
    yield ('| objects (60 each) | policy | 1 view | 2 | 3 | 5 views | ahead of random '
           '| ahead of the sweep | share of the gap |')
    yield '|---|---|---|---|---|---|---|---|---|'
    for cameras in _FOLDERS:
        for name, objects in _SETS.items():
            found = policies_of(f'{cameras}-{name}-learned')
            if (sequence := f'{cameras}-{name}-sequence') in STUDIES:
                found['sequence'] = policies_of(sequence)['sequence']
            shown = [policy for policy in (*_PLAIN[cameras].split(','), 'sequence', 'attention',
                                           'oracle') if policy in found]
            for policy in shown:
                yield _row(f'{cameras}, {objects}' if policy == shown[0] else '', policy,
                           found[policy])


def swapped_table() -> Iterator[str]:
    """Yield the lines of the table of what another object's volume costs, indented for a list."""
    yield '  | objects | another object | another object, turned |'
    yield '  |---|---|---|'
    for cameras in _FOLDERS:
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
