"""Table 4: time of each step of a single-view reconstruction."""

from collections.abc import Mapping, Sequence
import platform
from typing import Any

from active_recon.evaluation.statistics import Interval
from active_recon.paper import published
from active_recon.paper.claims import FAILS, HOLDS
from active_recon.paper.plotting import bars, canvas, drawn, Picture
from active_recon.paper.results import Claim, Column, counted, Result, Table
from active_recon.paper.study import Study
from active_recon.paper.timing import over_runs, timed_runs
from active_recon.paper.writing import provenance

STEPS = tuple(published.TABLE4)


def inputs(study: Study) -> dict[str, Any]:
    """Return the inputs of the table, see `provenance`."""
    return provenance(study, {'test': study.objects('test')}, {'measured': study.weights},
                      threads=study.threads)


def make(study: Study) -> Result:
    """Time the steps in fresh processes."""
    runs = timed_runs(study)
    steps = {step: over_runs([run['steps'][step] for run in runs]) for step in STEPS}
    total = over_runs([sum(run['steps'].values()) for run in runs])
    text = (
        f'Seconds of a single-view reconstruction, the mean of {len(runs)} fresh processes on '
        f'{counted(study.threads, "CPU thread")} ({platform.machine()}). Loading counts the '
        'import of the libraries; pre-processing reads an image, lays it on white and brings it '
        "to the network's camera; the prediction is the process's first, and so its slowest; the "
        'outputs are voxels and a mesh. Brackets are 95 % intervals over processes. The paper '
        'measured a graphics card of its time.')
    return Result('Table 4: time of each step of a single-view reconstruction', text,
                  [table(steps, total)], [claim(steps)], _picture(steps))


def table(steps: Mapping[str, Interval], total: Interval) -> Table:
    """Return a table of seconds and percentages, with the published ones."""
    printed = published.TABLE4
    return Table('Time of each step', 'step', [*steps, 'total'], [
        Column('seconds', [*steps.values(), total]),
        Column('percent', [*(f'{100 * value.mean / total.mean:.1f}' for value in steps.values()),
                           '100.0']),
        Column('seconds', [*(printed[step][0] for step in steps), published.TABLE4_TOTAL],
               published=True),
        Column('percent', [*(f'{printed[step][1]:.2f}' for step in steps), None],
               published=True)], digits=4)


def claim(steps: Mapping[str, Interval]) -> Claim:
    """Decide whether the steps have the paper's order, by their mean times."""
    order = sorted(steps, key=lambda step: -steps[step].mean)
    papers: Sequence[str] = sorted(STEPS, key=lambda step: -published.TABLE4[step][0])
    return Claim(f'The longest steps are, in this order, {", ".join(papers)}',
                 HOLDS if order == list(papers) else FAILS,
                 f'Measured order: {", ".join(order)}.')


def _picture(steps: Mapping[str, Interval]) -> Picture:
    with canvas(6, 3.2) as (figure, axes):
        bars(axes[0][0], list(steps), {'seconds': list(steps.values())}, 'seconds')
        axes[0][0].set_yscale('log')
        return drawn(figure)
