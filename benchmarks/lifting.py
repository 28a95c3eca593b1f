"""
The studies of the default network, and the tables of the documents that show their figures.

`python -m benchmarks.lifting FOLDER [STUDY ...]` runs them on the data in a folder (doc/results.md
lists the commands that make it); `python -m benchmarks.lifting` only updates the tables.
"""

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
import shutil
from typing import Any

from active_recon.models.weights_files import DEFAULT_MODEL, PAPER_MODEL, SMALL_MODEL
from benchmarks.studies import chosen_studies, run_study, with_tables_between_marks

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs' / 'results' / 'lifting'
DOCUMENTS = (ROOT / 'README.md', ROOT / 'doc' / 'results.md',
             ROOT / 'active_recon' / 'weights' / 'MODEL_CARD.md')
_MODELS = (DEFAULT_MODEL, SMALL_MODEL, 'carving', PAPER_MODEL)
_HOW = '--threads 1 --runtime auto --no-bf16'
_BESIDE = f'--models {",".join(_MODELS)} {_HOW}'
_KNOWN = '--surfaces 1,5 --disturbed-views 0'
STUDIES: Mapping[str, str] = {
    'parametric-test': f'data/test {_BESIDE} {_KNOWN}',
    'parametric-unseen': f'data/unseen {_BESIDE} {_KNOWN}',
    'real-val': f"data/real_val {_BESIDE} --category '!thing_*' {_KNOWN}",
    'things-val': f"data/real_val {_BESIDE} --category 'thing_*' {_KNOWN}",
    'any-cameras-unseen': f'any/unseen --models {",".join(_MODELS[:3])} {_HOW} {_KNOWN}',
    'robustness': f"any/test any/unseen --models {SMALL_MODEL},{DEFAULT_MODEL} --counts 1,5 "
                  "--surfaces '' --threads 1 --runtime openvino --no-bf16 "
                  '--disturbed-views 5 --disturbed-objects 104',
    'photographs': f'--photos photos/dino_sparse_ring {_BESIDE}',
    'r2n2-chairs': f"data/r2n2_sample {_BESIDE} --surfaces '' --disturbed-views 0",
}
SETS: Mapping[str, str] = {
    'parametric-test': 'parametric test',
    'parametric-unseen': 'categories never trained on',
    'real-val': 'real models, known categories',
    'things-val': 'real everyday things',
}
_COUNTS = (1, 2, 3, 5, 8, 24)
_FILLED_COUNTS = (1, 3, 5, 8)
_BOUNDED = (1, 24)
"""Numbers of views whose intervals the long table has room for."""
_SHORT_COUNTS = (1, 5, 24)


def run(folder: Path, name: str) -> None:
    """Run a study in a folder and keep what it writes: JSON, Markdown, and the picture."""
    out = run_study('study', STUDIES[name], 'study', folder, RESULTS / name)
    for picture in out.glob('*.png'):
        if (kept := RESULTS / f'{name}.png').exists():
            shutil.copy(picture, kept)


def figures_by_set(score: str = 'iou_32') -> Iterator[
        tuple[str, Mapping[str, Mapping[int, Any]]]]:
    """
    Yield each set's title, and every model's IoU at 32 cells by number of random views.

    With them comes how far the default is ahead of each other one, as `ahead of MODEL`.
    """
    for name, title in SETS.items():
        figures = json.loads((RESULTS / f'{name}.json').read_text())['sets'][0]
        measured = {**{model: own['random'] for model, own in figures['models'].items()},
                    **{f'ahead of {model}': own['random']
                       for model, own in figures['ahead'].items()}}
        yield f'{title} ({figures["objects"]})', {
            model: dict(zip(figures['counts'], own[score], strict=True))
            for model, own in measured.items()}


def long_table() -> Iterator[str]:
    """Yield a Markdown table with a row for each set and model."""
    yield from _head('model')
    for title, models in figures_by_set():
        for model in _MODELS:
            yield _row(title if model == DEFAULT_MODEL else '',
                       f'**{model}**' if model == DEFAULT_MODEL else model, *(
                           _bounded(models[model][count]) if count in _BOUNDED
                           else _mean(models[model][count]) for count in _COUNTS))


def ahead_table() -> Iterator[str]:
    """Yield a Markdown table of how far the default is ahead of each other model."""
    yield from _head('ahead of')
    for title, models in figures_by_set():
        for model in _MODELS[1:]:
            yield _row(title if model == SMALL_MODEL else '', model, *(
                _bounded(models[f'ahead of {model}'][count]) for count in _COUNTS))


def filled_table() -> Iterator[str]:
    """Yield a Markdown table of the default beside truths as they are, and beside filled ones."""
    yield _row('objects', 'model', 'truth', '1 view', *(f'{n} views' for n in _FILLED_COUNTS[1:]))
    yield '|---' * (len(_FILLED_COUNTS) + 3) + '|'
    for (title, own), (_, filled) in zip(figures_by_set(), figures_by_set('filled_iou_32'),
                                         strict=True):
        for first, model, truth, found in (
                (title, DEFAULT_MODEL, 'as it is', own), ('', DEFAULT_MODEL, '**filled**', filled),
                ('', 'carving', 'filled', filled)):
            yield _row(first, model, truth, *(_bounded(found[model][count])
                                              for count in _FILLED_COUNTS))


def short_table() -> Iterator[str]:
    """Yield a Markdown table with a row for each set, and a column for each model."""
    yield _row('objects', 'default network', f'small network (`{SMALL_MODEL}`)',
               'visual hull (carving)', "the paper's network")
    yield '|---' * 5 + '|'
    for title, models in figures_by_set():
        yield _row(title, *(', '.join(_mean(models[model][count]) for count in _SHORT_COUNTS)
                            for model in _MODELS))


def _head(of_rows: str) -> Iterator[str]:
    yield _row('objects', of_rows, '1 view', *(f'{count} views' for count in _COUNTS[1:]))
    yield '|---' * (len(_COUNTS) + 2) + '|'


def _row(*cells: str) -> str:
    return f'| {" | ".join(cells)} |'


def _mean(value: Mapping[str, Any]) -> str:
    return f'{value["mean"]:.3f}'


def _bounded(value: Mapping[str, Any]) -> str:
    return f'{_mean(value)} [{value["low"]:.3f}, {value["high"]:.3f}]'


def with_tables(text: str) -> str:
    """Return a document with the tables between its marks made anew from the results."""
    return with_tables_between_marks(text, {
        'iou': long_table, 'iou-ahead': ahead_table, 'iou-filled': filled_table,
        'iou-short': short_table})


def main() -> None:
    """Run the studies named, or all, where a folder is given; then write the tables."""
    folder, names = chosen_studies(STUDIES)
    for name in names:
        run(folder, name)
    for path in DOCUMENTS:
        path.write_text(with_tables(path.read_text()))


if __name__ == '__main__':
    main()
