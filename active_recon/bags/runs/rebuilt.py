"""Reconstructions of a bag that was recorded without any, from its images."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

from active_recon.bags.runs.loop_setup import recorded_setup
from active_recon.bags.runs.recorded_object import replay_views
from active_recon.bags.runs.run import RecordedEpisode, RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.reconstructor import Reconstructor

_NODE = 'reconstructor'


def lacks_reconstruction(run: RecordedRun) -> bool:
    """Return whether there is a view without a recorded reconstruction."""
    return any(view.reconstruction is None and view.occupied is None
               for episode in run.episodes for view in episode.views)


def rebuilt(run: RecordedRun, scene: Scene,
            weights: Path | None = None) -> tuple[RecordedRun, str]:
    """
    Return a run with reconstructions, and what computed them in words: '' if they were recorded.

    `weights` None are those of the recording, or the shipped ones. Raises WeightsError if they
    are not found, ViewError on an invalid view.
    """
    if not lacks_reconstruction(run):
        return run, ''
    reconstructor = recorded_setup(
        run, weights, weights is not None, scene.parameters).load_reconstructor()
    made_by = f'the weights {reconstructor.provenance["weights_sha256"][:12]}'
    return with_reconstruction(run, reconstructor), made_by


def with_reconstruction(run: RecordedRun, reconstructor: Reconstructor) -> RecordedRun:
    """
    Return the run with the reconstructions of its images.

    Depth images that could not be used are counted as the node would.
    """
    network = {'needs_front': reconstructor.provenance['needs_front']}
    refused: Counter[str] = Counter()
    episodes = [_reconstructed(episode, reconstructor, refused) for episode in run.episodes]
    counted = {**refused, **run.counters.get(_NODE, {})}
    return replace(run, provenance={**run.provenance, **network}, episodes=episodes,
                   counters={**run.counters, **({_NODE: counted} if counted else {})})


def _reconstructed(episode: RecordedEpisode, reconstructor: Reconstructor,
                   refused: Counter[str]) -> RecordedEpisode:
    views = []
    for step in replay_views(episode.views, reconstructor):
        grid = step.known.grid
        refused.update(['warned/depth'] if step.known.depth_refusal else [])
        views.append(replace(step.view, reconstruction=grid, entropy=grid.entropy(),
                             occupied=grid.above(reconstructor.threshold),
                             quality=step.known.quality))
    return replace(episode, views=views)
