"""The content of a bag, and whether it can be replayed."""

from dataclasses import dataclass
from pathlib import Path

from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.reading import run_in
from active_recon.bags.runs.recorded_object import with_option_hint
from active_recon.bags.runs.run import RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.bags.storage.bag import BagSummary
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ActiveReconError, ViewError
from active_recon.geometry.canonical import network_image
from active_recon.reporting import Reporting, silent


@dataclass(frozen=True)
class BagDescription:
    """A bag's content, its run or None, and what is `missing` for a replay, '' if nothing."""

    summary: BagSummary
    run: RecordedRun | None
    missing: str


def describe_bag(path: Path, topics: Topics, scene: Scene,
                 reporting: Reporting = silent) -> BagDescription:
    """Describe a bag; raises DataError if there is none, or a damaged one."""
    bag = open_bag(path)
    summary = bag.summary(reporting)
    try:
        run = run_in(bag, summary, path, topics, scene, reporting)
    except ActiveReconError as error:
        return BagDescription(summary, None, str(error).removeprefix(f'{path}: '))
    try:
        _require_views_fit(run, scene)
    except ActiveReconError as error:
        return BagDescription(summary, run, str(error).removeprefix(f'{path}: '))
    return BagDescription(summary, run, '')


def _require_views_fit(run: RecordedRun, scene: Scene) -> None:
    """Raise the error of a replay whose network cannot take a view."""
    reconstructor = recorded_setup(run, scene_parameters=scene.parameters).load_reconstructor()
    views = [view for episode in run.episodes for view in episode.views]
    for number, view in enumerate(views, 1):
        try:
            network_image(view.image, view.camera, reconstructor.spec, reconstructor.object_size)
        except ViewError as error:
            raise ViewError(f'view {number}: {with_option_hint(error)}', error.kind) from error
