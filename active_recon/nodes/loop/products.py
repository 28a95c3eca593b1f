"""What comes out of an episode: its coloured mesh, in files and as a Marker, and its state."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from threading import Thread

from active_recon.errors import DataError
from active_recon.geometry.cameras import Camera
from active_recon.meshes.files import write_mesh
from active_recon.meshes.photos import Album, Photo
from active_recon.nodes.loop.mesh_publisher import MeshPublisher
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.output import output_path
from active_recon.nodes.runtime.run import one_line
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.saved_states import SavedState, SUFFIX, write_state
from msg_tools.episodes import Episode
import numpy as np
from numpy.typing import NDArray
from std_srvs.srv import Trigger

_MESHING = ('active_recon.meshes.coloring', 'active_recon.volumes.isosurface',
            'active_recon.volumes.refinement')
"""What makes meshes, a third of the node's start; see `meshing_imported`."""


class Products:
    """
    The products of the reconstructor's current episode.

    With `publish_mesh` each shape is published on `mesh`, see MeshPublisher.
    """

    def __init__(self, node: ManagedNode, reconstructor: Reconstructor, frame: str,
                 publish_mesh: bool) -> None:
        self._reconstructor = reconstructor
        self._album = Album()
        self._known: Reconstruction | None = None
        self._last_camera: Camera | None = None
        self._marker = MeshPublisher(node, frame) if publish_mesh else None
        if self._marker is not None:
            node.add_cleanup(self._marker.close)

    def begin_episode(self, episode: Episode) -> None:
        """Forget the episode before."""
        self._episode = episode
        self._album.clear()
        self._known = self._last_camera = None
        if self._marker is not None:
            self._marker.clear(episode.begin)

    def add_view(self, stamp: int, image: NDArray[np.uint8], camera: Camera,
                 reconstruction: Reconstruction) -> None:
        """Keep the image (H, W, 3) uint8 of a view, at a stamp in nanoseconds, and its result."""
        self._album.add(Photo.of(image, camera, self._reconstructor.object_size))
        self._last_camera = camera
        self._take(stamp, reconstruction)

    def take_up(self, saved: SavedState) -> None:
        """Go on from a saved episode at the beginning of this one."""
        for photo in saved.photos:
            self._album.add(photo)
        self._last_camera = saved.last_camera
        self._take(self._episode.begin, saved.reconstruction)

    def save_mesh(self, output_dir: Path, suffix: str,
                  response: Trigger.Response) -> Trigger.Response:
        """Write the coloured mesh; answer with its path, or why it was not written."""
        def write(path: Path, known: Reconstruction) -> None:
            from active_recon.meshes.coloring import colored
            from active_recon.volumes.refinement import refined_mesh

            mesh = refined_mesh(known.grid, self._reconstructor.threshold)
            write_mesh(colored(mesh, self._album.photos), path)

        return self._written(output_dir, f'.{suffix}', 'a mesh', write, response)

    def save_state(self, output_dir: Path, response: Trigger.Response) -> Trigger.Response:
        """Write the state of the episode; answer with its path, or why it was not written."""
        def write(path: Path, known: Reconstruction) -> None:
            assert self._last_camera is not None
            write_state(SavedState(self._reconstructor.progress, known, self._album.photos,
                                   self._last_camera), self._reconstructor, path)

        return self._written(output_dir, SUFFIX, 'a state', write, response)

    def _take(self, stamp: int, reconstruction: Reconstruction) -> None:
        self._known = reconstruction
        if self._marker is not None:
            self._marker.publish(stamp, reconstruction.grid, self._reconstructor.threshold,
                                 self._album.photos)

    def _written(self, output_dir: Path, suffix: str, what: str,
                 write: Callable[[Path, Reconstruction], None],
                 response: Trigger.Response) -> Trigger.Response:
        """Write a file of the episode; raises ConfigError where its name leaves the folder."""
        if self._known is None:
            response.message = f'no view in this episode yet: expected one before {what}'
            return response
        name = f'{self._episode.id}-{self._reconstructor.view_count}{suffix}'
        path = output_path(output_dir, name)
        try:
            write(path, self._known)
        except (DataError, OSError) as error:
            response.message = f'{path} was not written: {one_line(error)}'
        else:
            response.success, response.message = True, str(path)
        return response


@contextmanager
def meshing_imported() -> Iterator[None]:
    """
    Import what makes meshes while the body runs; it is there once the body ends.

    A node does so before it subscribes: streams would overflow while it imports.
    """
    beside = Thread(target=lambda: [import_module(module) for module in _MESHING])
    beside.start()
    try:
        yield
    finally:
        beside.join()
