"""Photos that were reconstructed, as a run that can be written as a bag."""

from pathlib import Path
import time

from active_recon import __version__
from active_recon.bags.runs.run import PHOTOS, RecordedEpisode, RecordedRun, RecordedView
from active_recon.photos.shape import Shape
from active_recon.volumes.voxels import PUBLISHED_FLOOR

_PERIOD_NS = 1_000_000_000


def photo_run(shape: Shape, folder: Path, begin: int | None = None) -> RecordedRun:
    """
    Return the run of one episode in which the photos were taken, a second apart.

    `begin` is its begin in nanoseconds since 1970; None: so that it ends now. The images are those
    that the network was shown, so that a replay gives the same; the reconstructions are the
    network's own, before masks cut anything off. `folder` will be that of the bag.
    """
    start = time.time_ns() - len(shape.views) * _PERIOD_NS if begin is None else begin
    views = []
    for number, view in enumerate(shape.views, 1):
        grid = view.known.grid
        views.append(RecordedView(
            start + number * _PERIOD_NS, view.image, view.camera, grid.above(PUBLISHED_FLOOR),
            grid.above(shape.threshold), view.known.latent, grid.entropy(), None, {},
            quality=view.known.quality, depth=view.depth))
    end = views[-1].stamp
    episode = RecordedEpisode('photos', start, None, views, PHOTOS)
    provenance = {'version': __version__, 'object': 'photos', **shape.provenance}
    parameters = {'/reconstructor': {'object_size': shape.size, 'threshold': shape.threshold,
                                     'threads': 1, 'use_depth': any(
                                         view.depth is not None for view in shape.views)}}
    return RecordedRun(folder, [episode], provenance, parameters, {}, (), start, end)
