"""One bag to its rows, in a worker."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from itertools import repeat
import math
from pathlib import Path
from typing import Any

from active_recon.bags.replay.comparison import compare
from active_recon.bags.replay.replay import replay, ReplayedEpisode
from active_recon.bags.replay.what_if import run_with_overrides
from active_recon.bags.runs.loop_setup import LoopSetup, Overrides, recorded_setup
from active_recon.bags.runs.reading import read_run
from active_recon.bags.runs.rebuilt import lacks_reconstruction, with_reconstruction
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun
from active_recon.batch.results import BagResult, name_of
from active_recon.batch.rows import episode_row, refusal_row, refused_row, Row
from active_recon.batch.task import state_of, Task
from active_recon.cluster.results import is_no_room, UNEXPECTED
from active_recon.cluster.stores import at_hand, Place, whole
from active_recon.errors import ActiveReconError, DataError, WorkError
from active_recon.interrupts import is_interrupted
from active_recon.reconstructor import Reconstructor
from active_recon.report.page import MAX_SUBJECTS, report_page
from active_recon.report.subject import letters, object_of, Subject
from active_recon.report.truth import known_truth, Truth

PASSING = {'file', 'not_seen', 'worker_died'}
"""Kinds of refusals that may be over at a second start, which tries again."""


@dataclass(frozen=True)
class BagDone:
    """What the driver is told of a bag; `kept`: its result was there already."""

    refused: bool
    kept: bool


def do_bag(task: Task, identity: str, bag: Place) -> BagDone:
    """
    Write the result of one bag, unless it is there; what refuses the bag becomes its row.

    Raises OSError, or an error that has it as its cause, where there is no room to write, and
    WorkError where the store of the results cannot be reached.
    """
    state = ''
    try:
        state = state_of(bag, identity)
        kept = BagResult.read(task.out, bag)
        if kept is not None and kept.state == state and _has_reports(task.out, kept):
            return BagDone(kept.refused, True)
        result = BagResult(state, rows_of(task, bag))
    except WorkError:
        raise
    except ActiveReconError as error:
        if is_no_room(error):
            raise
        result = BagResult('' if error.kind in PASSING else state,
                           [refused_row(str(bag), error)])
    except OSError as error:
        if is_no_room(error):
            raise
        result = BagResult('', [refusal_row(str(bag), f'{bag}: cannot be read: {error}', 'file')])
    except Exception as error:  # a fault that one bag in a million shows is that bag's
        passing = isinstance(error, MemoryError)  # with fewer workers there may be enough
        result = BagResult('' if passing else state, [refusal_row(
            str(bag), f'{bag}: {type(error).__name__}: {error}', UNEXPECTED)])
    if result.refused and is_interrupted():  # it would be kept of a bag that has nothing wrong
        raise KeyboardInterrupt
    result.write(task.out, bag)
    return BagDone(result.refused, False)


def _has_reports(out: Place, kept: BagResult) -> bool:
    """Return whether the pages that a result names are there still."""
    pages = (row.get('report') for row in kept.rows)
    return all((out / str(page)).exists() for page in pages if page)


def rows_of(task: Task, bag: Place) -> list[Row]:
    """Return a row for each episode of a bag; raises ActiveReconError where it is refused."""
    with at_hand(bag) as path:
        run = read_run(path, task.topics, task.scene)
        run, computed, verdicts = _considered(task, run)
        if not run.episodes:
            raise DataError(f'{path}: no episode: expected one or more, got none', 'no_episode')
        names = [object_of(run, episode) for episode in run.episodes]
        truths = {name: _truth(task, run, name) for name in dict.fromkeys(names)}
        subjects = [
            Subject(letter, run, episode, true.cells if true else None, computed,
                    true.placed if true else '')
            for letter, episode, true in zip(
                letters(), run.episodes, map(truths.get, names), strict=False)]
        pages = _write_pages(task, bag, [each for each in subjects if each.views])
        return [episode_row(str(bag), number, subject, verdict, pages.get(subject.letter, ''))
                for number, (subject, verdict) in enumerate(
                    zip(subjects, verdicts or repeat(''), strict=False), 1)]


def _truth(task: Task, run: RecordedRun, name: str) -> Truth | None:
    """Return the true shape of a run's object of a name; None where it is not known."""
    if task.truth is None:
        return known_truth(run)
    return task.truth.read(run, name, task.scene.object_size, task.scene.object_yaw)


def _considered(task: Task, run: RecordedRun) -> tuple[RecordedRun, str, Sequence[str]]:
    """
    Return the run that the rows are of, what computed its shapes, and a replay's verdicts.

    There is one for each episode; without a replay there is none.
    """
    computes = (task.kind == 'replay' or task.overrides != Overrides()
                or lacks_reconstruction(run))
    if not computes:
        return run, '', ()
    setup = _KeptSetup.of(recorded_setup(run, task.overrides.weights,
                                         task.overrides.weights is not None,
                                         task.scene.parameters))
    made_by = f'the weights {setup.load_reconstructor().provenance["weights_sha256"][:12]}'
    if task.overrides != Overrides():
        return run_with_overrides(run, setup, task.overrides), '', ()
    reconstructor = setup.load_reconstructor()
    if task.kind != 'replay':
        run = replace(run, provenance={**run.provenance, **reconstructor.provenance})
        return with_reconstruction(run, reconstructor), made_by, ()
    episodes = replay(run, reconstructor, setup.load_planner())
    return (replace(run, provenance={**run.provenance, **reconstructor.provenance},
                    episodes=[_replayed(each, reconstructor.threshold) for each in episodes]), '',
            [compare([each], reconstructor.threshold).verdict for each in episodes])


def _replayed(episode: ReplayedEpisode, threshold: float) -> RecordedEpisode:
    """Return an episode with the reconstructions of its replay."""
    views = []
    for step in episode.steps:
        grid, quality = step.reconstruction.grid, step.reconstruction.quality
        views.append(replace(step.recorded, reconstruction=grid, entropy=grid.entropy(),
                             occupied=grid.above(threshold), quality=quality))
    return replace(episode.recorded, views=views)


def _write_pages(task: Task, bag: Place, subjects: list[Subject]) -> Mapping[str, str]:
    """Write the pages of a bag where they are asked for; return the page of each letter."""
    if task.kind != 'report':
        return {}
    pages: dict[str, str] = {}
    for number in range(math.ceil(len(subjects) / MAX_SUBJECTS)):
        shown = subjects[number * MAX_SUBJECTS:(number + 1) * MAX_SUBJECTS]
        page = f'reports/{name_of(bag)}{f"-{number + 1}" if number else ""}.html'
        with whole(task.out / page) as unfinished:
            # As names of files, it may have bytes that are not of UTF-8
            unfinished.write_text(report_page(shown), encoding='utf-8', errors='replace')
        pages |= dict.fromkeys((each.letter for each in shown), page)
    return pages


@dataclass(frozen=True)
class _KeptSetup(LoopSetup):
    """A setup whose network a worker keeps from bag to bag."""

    @classmethod
    def of(cls, setup: LoopSetup) -> '_KeptSetup':
        return cls(**{each.name: getattr(setup, each.name) for each in fields(setup)})

    def load_reconstructor(self) -> Reconstructor:
        return _kept_reconstructor(self.weights, self.threads, self.runtime, self.precision,
                                   tuple(sorted(self.reconstructor.items())))


@lru_cache(maxsize=2)
def _kept_reconstructor(weights: Path, threads: int, runtime: str, precision: str,
                        parameters: tuple[tuple[str, Any], ...]) -> Reconstructor:
    return Reconstructor.load(weights, threads=threads, runtime=runtime, precision=precision,
                              **dict(parameters))
