"""What a page shows: one episode of a run, with its true shape."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count, product
import math
from pathlib import Path
from string import ascii_uppercase

from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import (
    PHOTOS,
    RecordedEpisode,
    RecordedGoal,
    RecordedRun,
    RecordedView,
)
from active_recon.geometry.cameras import azimuth_difference
from active_recon.geometry.view_distance import at_one_elevation
from active_recon.volumes.voxels import iou, VoxelGrid
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Subject:
    """
    One episode that has views, with its letter on the page.

    `truth` has the object's true cells, (X, Y, Z), if they are known, and `placed` says how they
    were placed. `computed` names the weights that made the reconstruction, if the bag had none.
    """

    letter: str
    run: RecordedRun
    episode: RecordedEpisode
    truth: NDArray[np.bool_] | None = None
    computed: str = ''
    placed: str = ''

    @property
    def views(self) -> Sequence[RecordedView]:
        """The views in the order in which they were taken."""
        return self.episode.views

    @property
    def of_photos(self) -> bool:
        """Whether the views are photos with known cameras, which no planner chose."""
        return self.episode.done == PHOTOS

    @property
    def planned(self) -> bool:
        """Whether a planner asked for views, or ended the episode."""
        return not self.of_photos and (bool(self.episode.done) or any(
            goal is not None for goal in self.goals))

    @property
    def end(self) -> str:
        """Why the episode ended; '' where it has no end, `no_planner` where none decided it."""
        return self.episode.done if self.planned or self.of_photos else 'no_planner'

    @property
    def timed(self) -> bool:
        """Whether the times of its messages are a loop's: replays and photos have stamps alone."""
        return not self.of_photos and 'replay_of' not in self.run.provenance

    @property
    def goals(self) -> list[RecordedGoal | None]:
        """The goal of each view; without views that of the first, which was not taken."""
        decided = [self.episode.first_goal, *(view.goal for view in self.views[:-1])]
        return [goal and goal.final for goal in decided]

    @cached_property
    def threshold(self) -> float:
        """The threshold of occupied cells, from the recorded grids."""
        above, below = 1.0, 0.0
        for view in self.views:
            grid = shown_grid(view)
            if grid is not None and view.occupied is not None:
                chosen, occupancy = view.occupied.occupied(0), grid.occupancy
                above = min(above, float(occupancy.min(initial=1, where=chosen)))
                below = max(below, float(occupancy.max(initial=0, where=~chosen)))
        if below == 0 and above < 1:  # without probabilities: just below all that is occupied
            return float(np.nextafter(np.float32(above), np.float32(0)))
        return (above + below) / 2

    @property
    def entropies(self) -> list[float | None]:
        """Nats after each view, None if unknown."""
        return [view.entropy if view.entropy is not None and math.isfinite(view.entropy) else None
                for view in self.views]

    @cached_property
    def ious(self) -> list[float | None]:
        """IoU with the true shape after each view, None if unknown."""
        return [None if self.truth is None or view.occupied is None
                else float(iou(view.occupied.occupied(0), self.truth)) for view in self.views]

    @property
    def has_elevations(self) -> bool:
        """Whether the views' elevations differ by more than a turntable's camera lets them."""
        directions = np.array([view.camera.direction for view in self.views])
        return not at_one_elevation(directions)

    @property
    def travel(self) -> float:
        """Radians between consecutive views, each the shorter way, summed."""
        azimuths = [view.camera.azimuth for view in self.views]
        return float(np.abs(azimuth_difference(azimuths[1:], azimuths[:-1])).sum())


def shown_grid(view: RecordedView) -> VoxelGrid | None:
    """Return the probabilities after a view, else its occupied cells, else None."""
    return view.reconstruction if view.reconstruction is not None else view.occupied


def object_of(run: RecordedRun, episode: RecordedEpisode) -> str:
    """
    Return the name of an episode's object, of a mesh file its stem; '' where it is not known.

    That of a dataset is CATEGORY/NAME, in which a dot begins no suffix. A bag has the name of the
    object that its camera showed first; one of a dataset may have shown another in each later
    episode.
    """
    if episode is not run.episodes[0] and node_parameters(run, 'turntable_camera').get('dataset'):
        return ''
    name = run.provenance.get('object', '')
    return name if '/' in name else Path(name).stem


def letters() -> Iterator[str]:
    """Yield A, B, ..., Z, then AA, AB, ..., without end."""
    for size in count(1):
        yield from map(''.join, product(ascii_uppercase, repeat=size))


def elevation_degrees(radians: float) -> int:
    """Return an elevation as whole degrees in [-90, 90]."""
    return round(math.degrees(radians))
