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

from benchmarks.studies import chosen_studies, run_study, with_tables_between_marks

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / 'docs' / 'results' / 'lifting'
DOCUMENTS = (ROOT / 'README.md', ROOT / 'doc' / 'results.md',
             ROOT / 'active_recon' / 'weights' / 'MODEL_CARD.md')
_BESIDE = '--models lifting,carving,2d3d-attention --threads 1'
_KNOWN = '--surfaces 1,5 --disturbed-views 0'
_IN_OPENVINO = '--threads 1 --runtime openvino --no-bf16'
_LARGE = f"--models lifting-large,lifting {_IN_OPENVINO} --surfaces '' --disturbed-views 0"
STUDIES: Mapping[str, str] = {
    'parametric-test': f'data/test {_BESIDE} --surfaces 1,5 --disturbed-views 5 '
                       '--disturbed-objects 12',
    'parametric-unseen': f'data/unseen {_BESIDE} {_KNOWN}',
    'real-val': f"data/real_val {_BESIDE} --category '!thing_*' --objects 60 {_KNOWN}",
    'things-val': f"data/real_val {_BESIDE} --category 'thing_*' --objects 60 {_KNOWN}",
    'any-cameras-unseen': 'any/unseen --models lifting,carving --threads 1 --disturbed-views 5 '
                          '--disturbed-objects 24',
    'robustness': "any/test any/unseen --models lifting,lifting-large --counts 1,5 --surfaces '' "
                  f'{_IN_OPENVINO} --disturbed-views 5 --disturbed-objects 104',
    'photographs': f'--photos photos/dino_sparse_ring {_BESIDE}',
    'r2n2-chairs': f"data/r2n2_sample {_BESIDE} --surfaces '' --disturbed-views 0",
    'large-parametric-test': 'data/test --models lifting-large,lifting,carving --threads 1 '
                             f'--runtime auto --no-bf16 {_KNOWN}',
    'large-parametric-unseen': f'data/unseen {_LARGE}',
    'large-real-val': f"data/real_val {_LARGE} --category '!thing_*' --objects 60",
    'large-things-val': f"data/real_val {_LARGE} --category 'thing_*' --objects 60",
    'large-photographs': '--photos photos/dino_sparse_ring --models lifting-large,lifting '
                         f'{_IN_OPENVINO}',
    'large-r2n2-chairs': f'data/r2n2_sample {_LARGE}',
}
SETS: Mapping[str, str] = {
    'parametric-test': 'parametric test',
    'parametric-unseen': 'categories never trained on',
    'real-val': 'real models, known categories',
    'things-val': 'real everyday things',
}
_COUNTS = (1, 2, 3, 5, 8, 24)
_BOUNDED = (1, 24)
"""Numbers of views whose intervals the long table has room for."""
_SHORT_COUNTS = (1, 5, 24)
_MODELS = ('lifting', 'carving', '2d3d-attention')


def run(folder: Path, name: str) -> None:
    """Run a study in a folder and keep what it writes: JSON, Markdown, and the picture."""
    out = run_study('study', STUDIES[name], 'study', folder, RESULTS / name)
    for picture in out.glob('*.png'):
        if (kept := RESULTS / f'{name}.png').exists():
            shutil.copy(picture, kept)


def figures_by_set(prefix: str = '') -> Iterator[tuple[str, Mapping[str, Mapping[int, Any]]]]:
    """
    Yield each set's title, and every model's IoU at 32 cells by number of random views.

    With them comes how far the first model is ahead of each other one, as `ahead of MODEL`.
    `prefix` is that of the studies' names.
    """
    for name, title in SETS.items():
        figures = json.loads((RESULTS / f'{prefix}{name}.json').read_text())['sets'][0]
        measured = {**{model: own['random'] for model, own in figures['models'].items()},
                    **{f'ahead of {model}': own['random']
                       for model, own in figures['ahead'].items()}}
        yield f'{title} ({figures["objects"]})', {
            model: dict(zip(figures['counts'], own['iou_32'], strict=True))
            for model, own in measured.items()}


def long_table() -> Iterator[str]:
    """Yield a Markdown table with a row for each set and model."""
    yield _row('objects', 'model', '1 view', *(f'{count} views' for count in _COUNTS[1:]))
    yield '|---' * (len(_COUNTS) + 2) + '|'
    for title, models in figures_by_set():
        label = title
        for model in _MODELS:
            yield _row(label, f'**{model}**' if model == 'lifting' else model, *(
                _bounded(models[model][count]) if count in _BOUNDED
                else _mean(models[model][count]) for count in _COUNTS))
            label = ''


def large_table() -> Iterator[str]:
    """Yield a Markdown table of the large network beside the default, and of their difference."""
    yield _row('objects', 'model', '1 view', *(f'{count} views' for count in _COUNTS[1:]))
    yield '|---' * (len(_COUNTS) + 2) + '|'
    for title, models in figures_by_set('large-'):
        for label, model, shown in ((title, 'lifting-large', _mean), ('', 'lifting', _mean),
                                    ('', 'ahead of lifting', _bounded)):
            yield _row(label, model, *(shown(models[model][count]) for count in _COUNTS))


def short_table() -> Iterator[str]:
    """Yield a Markdown table with a row for each set, and a column for each model."""
    yield _row('objects', 'default network', '`lifting-large`', 'visual hull (carving)',
               "the paper's network")
    yield '|---' * 5 + '|'
    for (title, models), (_, larger) in zip(figures_by_set(), figures_by_set('large-'),
                                            strict=True):
        every = {**models, 'lifting-large': larger['lifting-large']}
        yield _row(title, *(', '.join(_mean(every[model][count]) for count in _SHORT_COUNTS)
                            for model in ('lifting', 'lifting-large', 'carving',
                                          '2d3d-attention')))


def _row(*cells: str) -> str:
    return f'| {" | ".join(cells)} |'


def _mean(value: Mapping[str, Any]) -> str:
    return f'{value["mean"]:.3f}'


def _bounded(value: Mapping[str, Any]) -> str:
    return f'{_mean(value)} [{value["low"]:.3f}, {value["high"]:.3f}]'


def with_tables(text: str) -> str:
    """Return a document with the tables between its marks made anew from the results."""
    return with_tables_between_marks(text, {
        'iou': long_table, 'iou-short': short_table, 'iou-large': large_table})


def main() -> None:
    """Run the studies named, or all, where a folder is given; then write the tables."""
    folder, names = chosen_studies(STUDIES)
    for name in names:
        run(folder, name)
    for path in DOCUMENTS:
        path.write_text(with_tables(path.read_text()))


if __name__ == '__main__':
    main()
