"""
Measure the parts named, or all but those that are measured by themselves; print their table.

`--keep` writes them to docs/results/benchmarks.json, and its table to doc/benchmarks.md.
"""

import argparse
from collections.abc import Callable, Mapping
import platform
import sys

from benchmarks.bags import replay_figure, report_figure
from benchmarks.converters import converter_figures
from benchmarks.core import (
    episode_figures,
    framing_figures,
    rendering,
    rendering_of_candidates,
)
from benchmarks.evaluation import evaluation_figures
from benchmarks.figures import Figure, reference_ms
from benchmarks.goal import goal_figures, single_process_figures
from benchmarks.idle import idle_figure
from benchmarks.loop import demo_figure, reconstructor_figures
from benchmarks.mapped_memory import memory_figures
from benchmarks.published_networks import published_figures
from benchmarks.record import HEAD, keep, part_record, rows
from benchmarks.runtimes import runtime_figures, segmenter_figures, small_figures
from benchmarks.stream import stream_figures
from benchmarks.viewer import watching_figures

PARTS: Mapping[str, Callable[[], list[Figure]]] = {
    'memory': lambda: list(memory_figures()),
    'view': episode_figures,
    'runtimes': runtime_figures,
    'small': small_figures,
    'segmenter': segmenter_figures,
    'evaluation': evaluation_figures,
    'published': published_figures,
    'rendering': lambda: [rendering(1, 400), rendering(2, 100)],
    'framing': framing_figures,
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
BY_THEMSELVES = ('viewer', 'stream', 'bags')
"""Parts of minutes, or that nothing may run beside."""


def main() -> None:
    """Print a row for each figure as it comes."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks', description=__doc__)
    parser.add_argument('parts', nargs='*', help=f'out of {", ".join(PARTS)}')
    parser.add_argument('--keep', action='store_true')
    options = parser.parse_args()
    named = options.parts
    if unknown := [part for part in named if part not in PARTS]:
        sys.exit(f'expected parts out of {", ".join(PARTS)}, got {", ".join(unknown)}')
    reference = reference_ms()
    print(f'{platform.machine()}; reference (512 x 512 matrix product): {reference:.2f} ms')  # noqa: T201
    print('\n'.join(HEAD))  # noqa: T201
    measured = {}
    for part in named or (name for name in PARTS if name not in BY_THEMSELVES):
        measured[part] = part_record(PARTS[part](), reference)
        for row in rows(measured[part]):
            print(row, flush=True)  # noqa: T201
    if options.keep and (others := keep(measured, list(PARTS), BY_THEMSELVES)):
        print('kept beside these, of another machine or one that was not noted: '  # noqa: T201
              f'{", ".join(others)}')
    missed = [figure['name'] for part in measured.values() for figure in part['figures']
              if not figure['reached']]
    print(f'missed: {", ".join(missed)}' if missed else 'every goal is reached')  # noqa: T201


if __name__ == '__main__':
    main()
