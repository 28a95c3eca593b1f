"""What comes out of an episode: its coloured mesh, in files and as a Marker, and its state."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.meshes.files import write_mesh
from active_recon.meshes.photos import Album, Photo
from active_recon.nodes.loop.mesh_publisher import MeshPublisher
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.output import output_path
from active_recon.nodes.runtime.resting_timer import RestingTimer
from active_recon.nodes.runtime.run import one_line
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.saved_states import SavedState, SUFFIX, write_state
from msg_tools.episodes import Episode
import numpy as np
from numpy.typing import NDArray
from std_srvs.srv import Trigger

DEVELOP_S = 0.05
"""Time after a view at which its photograph is made: the planner has then chosen its goal."""
Write = Callable[[Trigger.Response], Trigger.Response]
"""Writes a file, fills in the answer with its path, or why it was not written, and returns it."""


class Products:
    """
    The products of the reconstructor's current episode.

    With `publish_mesh` each shape is published on `mesh`, see MeshPublisher.
    """

    def __init__(self, node: ManagedNode, reconstructor: Reconstructor, frame: str,
                 publish_mesh: bool) -> None:
        self._reconstructor = reconstructor
        self._album = Album()
        self._undeveloped: Callable[[], Photo] | None = None
        self._timer = RestingTimer(
            node, DEVELOP_S, self._develop, lambda: self._undeveloped is not None)
        self._known: Reconstruction | None = None
        self._last_camera: Camera | None = None
        self._marker = MeshPublisher(node, frame) if publish_mesh else None
        if self._marker is not None:
            node.add_cleanup(self._marker.close)

    def begin_episode(self, episode: Episode) -> None:
        """Forget the episode before."""
        self._episode = episode
        self._album.clear()
        self._undeveloped = self._known = self._last_camera = None
        if self._marker is not None:
            self._marker.clear(episode.begin)

    def add_view(self, stamp: int, image: NDArray[np.uint8], camera: Camera,
                 reconstruction: Reconstruction) -> None:
        """Keep the image (H, W, 3) uint8 of a view, at a stamp in nanoseconds, and its result."""
        self._develop()
        self._undeveloped = partial(Photo.of, image, camera, self._reconstructor.object_size)
        self._timer.wake()
        self._last_camera = camera
        self._take(stamp, reconstruction)

    def take_up(self, saved: SavedState) -> None:
        """Go on from a saved episode at the beginning of this one."""
        for photo in saved.photos:
            self._album.add(photo)
        self._last_camera = saved.last_camera
        self._take(self._episode.begin, saved.reconstruction)

    def mesh_writer(self, output_dir: Path, suffix: str) -> Write:
        """Return what writes the coloured mesh of the shape now; any thread may call it."""
        photos, threshold = self._photos(), self._reconstructor.threshold

        def write(path: Path, known: Reconstruction) -> None:
            # Not before the first mesh: they take a third of a node's start, and 70 MB
            from active_recon.meshes.coloring import colored
            from active_recon.volumes.refinement import refined_mesh

            write_mesh(colored(refined_mesh(known.grid, threshold), photos), path)

        return self._writer(output_dir, f'.{suffix}', 'a mesh', write)

    def save_state(self, output_dir: Path, response: Trigger.Response) -> Trigger.Response:
        """Write the state of the episode; answer with its path, or why it was not written."""
        def write(path: Path, known: Reconstruction) -> None:
            assert self._last_camera is not None
            write_state(SavedState(self._reconstructor.progress, known, self._photos(),
                                   self._last_camera), self._reconstructor, path)

        return self._writer(output_dir, SUFFIX, 'a state', write)(response)

    def _take(self, stamp: int, reconstruction: Reconstruction) -> None:
        self._known = reconstruction
        if self._marker is not None:
            self._marker.publish(stamp, reconstruction.grid, self._reconstructor.threshold,
                                 self._photos())

    def _photos(self) -> Sequence[Photo]:
        """Return the photographs of all views so far."""
        self._develop()
        return self._album.photos

    def _develop(self) -> None:
        """Make the photograph of the last view, where it is not made yet."""
        if self._undeveloped is not None:
            self._album.add(self._undeveloped())
            self._undeveloped = None

    def _writer(self, output_dir: Path, suffix: str, what: str,
                write: Callable[[Path, Reconstruction], None]) -> Write:
        """Return what writes a file of the episode, if it has a view."""
        known = self._known
        if known is None:
            return no_view_before(what)
        path = output_path(
            output_dir, f'{self._episode.id}-{self._reconstructor.view_count}{suffix}')

        def written(response: Trigger.Response) -> Trigger.Response:
            try:
                write(path, known)
            except (DataError, OSError) as error:
                response.message = f'{path} was not written: {one_line(error)}'
            else:
                response.success, response.message = True, str(path)
            return response

        return written


def no_view_before(what: str) -> Write:
    """Return what answers that there is no view to write `what` of."""
    def refused(response: Trigger.Response) -> Trigger.Response:
        response.message = f'no view in this episode yet: expected one before {what}'
        return response

    return refused
