"""The shapes of a bag that holds none: its images through a network."""

from dataclasses import replace
from pathlib import Path

from active_recon.bags.runs.recorded_object import seen_again
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.settings import recorded_settings
from active_recon.reconstructor import Reconstructor


def lacks_reconstruction(run: RecordedRun) -> bool:
    """Return whether there is a view after which no shape was recorded."""
    return any(view.reconstruction is None and view.occupied is None
               for episode in run.episodes for view in episode.views)


def rebuilt(run: RecordedRun, scene: Scene,
            weights: Path | None = None) -> tuple[RecordedRun, str]:
    """
    Return a run with its shapes, and in words what made them up: '' where they were recorded.

    `weights` None are those that the run was recorded with, or that ship. Raises WeightsError
    where they are not to be had, ViewError on a view that is none.
    """
    if not lacks_reconstruction(run):
        return run, ''
    reconstructor = recorded_settings(
        run, weights, weights is not None, scene.given).load_reconstructor()
    made_by = f'the weights {reconstructor.provenance["weights_sha256"][:12]}'
    return with_reconstruction(run, reconstructor), made_by


def with_reconstruction(run: RecordedRun, reconstructor: Reconstructor) -> RecordedRun:
    """Return the run with the shapes that its images give."""
    told = {'needs_front': reconstructor.provenance['needs_front']}
    return replace(run, provenance={**run.provenance, **told},
                   episodes=[_reconstructed(episode, reconstructor) for episode in run.episodes])


def _reconstructed(episode: RecordedEpisode, reconstructor: Reconstructor) -> RecordedEpisode:
    views = []
    for step in seen_again(episode.views, reconstructor):
        grid = step.known.grid
        views.append(replace(step.view, reconstruction=grid, entropy=grid.entropy(),
                             occupied=grid.above(reconstructor.threshold)))
    return replace(episode, views=views)
