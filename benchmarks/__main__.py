"""Measure everything or the parts named; print the table of doc/benchmarks.md, write JSON."""

from collections.abc import Callable, Mapping, Sequence
import json
from pathlib import Path
import platform
import sys

from benchmarks.bags import replay_figure, report_figure
from benchmarks.converters import converter_figures
from benchmarks.core import reconstruct_and_plan, rendering, rendering_of_candidates
from benchmarks.evaluation import evaluation_figures
from benchmarks.figures import Figure, reference_ms
from benchmarks.goal import goal_figures, single_process_figures
from benchmarks.idle import idle_figure
from benchmarks.loop import demo_figure, reconstructor_figures
from benchmarks.published_networks import published_figures
from benchmarks.runtimes import runtime_figures
from benchmarks.stream import stream_figures
from benchmarks.viewer import watching_figures

RESULTS = Path(__file__).parents[1] / 'docs' / 'results' / 'benchmarks.json'
PARTS: Mapping[str, Callable[[], list[Figure]]] = {
    'view': lambda: [reconstruct_and_plan()],
    'runtimes': runtime_figures,
    'evaluation': evaluation_figures,
    'published': published_figures,
    'rendering': lambda: [rendering(1, 400), rendering(2, 100)],
    'candidates': lambda: [rendering_of_candidates(32), rendering_of_candidates(64)],
    'reconstructor': reconstructor_figures,
    'goal': goal_figures,
    'single-process': single_process_figures,
    'idle': lambda: [idle_figure()],
    'viewer': watching_figures,
    'converters': converter_figures,
    'stream': stream_figures,
    'bags': lambda: [replay_figure(), report_figure()],
    'demo': lambda: [demo_figure()],
}


def main() -> None:
    """Print a row for each figure as it comes."""
    if unknown := [part for part in sys.argv[1:] if part not in PARTS]:
        sys.exit(f'expected parts out of {", ".join(PARTS)}, got {", ".join(unknown)}')
    reference = reference_ms()
    print(f'{platform.machine()}; reference (512 x 512 matrix product): {reference:.2f} ms')  # noqa: T201
    print('| figure | measured | 5 to 95 % | goal | x reference |\n|---|---|---|---|---|')  # noqa: T201
    figures = []
    for part in sys.argv[1:] or PARTS:
        for figure in PARTS[part]():
            figures.append(figure)
            print(_row(figure, reference), flush=True)  # noqa: T201
    if not sys.argv[1:]:
        _keep(figures, reference)
    missed = [figure.name for figure in figures if not figure.reached]
    print(f'missed: {", ".join(missed)}' if missed else 'every goal is reached')  # noqa: T201


def _keep(figures: Sequence[Figure], reference: float) -> None:
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps({
        'command': 'make bench', 'reference_ms': reference,
        'figures': [{'name': figure.name, 'unit': figure.unit, 'value': figure.value,
                     'percentile': figure.percentile, 'low_high': figure.spread,
                     'goal': figure.goal, 'reached': figure.reached,
                     'samples': len(figure.samples)} for figure in figures]}, indent=1) + '\n')


def _row(figure: Figure, reference: float) -> str:
    low, high = figure.spread
    goal = f'{"at least" if figure.more_is_better else "at most"} {figure.goal:g} {figure.unit}'
    milliseconds = {'ms': 1.0, 's': 1e3}.get(figure.unit)
    ratio = '' if milliseconds is None else f'{figure.value * milliseconds / reference:.1f}'
    return (f'| {figure.name} | {_digits(figure.value)} {figure.unit} '
            f'| {_digits(low)} to {_digits(high)} | {goal} | {ratio} |')


def _digits(value: float) -> str:
    return f'{value:.0f}' if value >= 100 else f'{value:.3g}'


if __name__ == '__main__':
    main()
