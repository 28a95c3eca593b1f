"""Publishes the coloured surface as a Marker, beside the loop and not in its way."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from threading import Thread
from typing import Any

from active_recon.errors import DataError
from active_recon.meshes.photos import Photo
from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.life_cycle import ManagedNode
from active_recon.nodes.runtime.qos import LATCHED_QOS
from active_recon.volumes.voxels import VoxelGrid
from msg_tools.markers import no_surface_to_msg, surface_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

PERIOD_S = 1.0
"""Surfaces are at least so far apart."""
_MESHING = ('active_recon.meshes.coloring', 'active_recon.volumes.isosurface')
"""What makes surfaces, half a second of a node's start; see `meshing_imported`."""


@contextmanager
def meshing_imported() -> Iterator[None]:
    """
    Import what makes surfaces while the body runs; it is there once the body ends.

    A node that publishes them does so before it subscribes: else its first views would be slow.
    """
    beside = Thread(target=lambda: [import_module(module) for module in _MESHING])
    beside.start()
    try:
        yield
    finally:
        beside.join()


@dataclass(frozen=True, eq=False)
class _Shape:
    grid: VoxelGrid
    threshold: float
    photos: Sequence[Photo]
    header: Header


class MeshPublisher:
    """
    Publishes `mesh`: the surface of the grid's own cells, with the colours of the photographs.

    A thread makes it, at most one a second; of the shapes that came meanwhile it takes the last.
    """

    def __init__(self, node: ManagedNode, frame: str) -> None:
        self._frame = frame
        self._publisher = node.create_publisher(Marker, 'mesh', LATCHED_QOS)
        self._thread = ThreadPoolExecutor(1, 'mesh')
        self._made: Future[Marker | None] | None = None
        self._next: _Shape | None = None
        node.create_timer(PERIOD_S, self._update, clock=STEADY)

    def close(self) -> None:
        """Wait for the surface that is being made, and drop it."""
        self._thread.shutdown()

    def clear(self, stamp: int) -> None:
        """Remove the surface: an episode began at a stamp in nanoseconds."""
        self._next = self._made = None
        self._publisher.publish(no_surface_to_msg(self._header(stamp)))

    def publish(self, stamp: int, grid: VoxelGrid, threshold: float,
                photos: Sequence[Photo]) -> None:
        """Publish the surface of a view with a stamp in nanoseconds, unless a later one comes."""
        self._next = _Shape(grid, threshold, photos, self._header(stamp))

    def _update(self) -> None:
        if self._made is not None:
            if not self._made.done():
                return
            marker, self._made = self._made.result(), None
            if marker is not None:
                self._publisher.publish(marker)
        if self._next is not None:
            self._made, self._next = self._thread.submit(_marker, self._next), None

    def _header(self, stamp: int) -> Header:
        return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=self._frame)


def _marker(shape: _Shape) -> Marker | None:
    """Return the surface of a shape, None where it has none yet."""
    from active_recon.meshes.coloring import colored  # see `meshing_imported`

    try:
        mesh = colored(shape.grid.mesh(shape.threshold), shape.photos)
    except DataError:
        return None
    visual: Any = mesh.visual
    colors = visual.vertex_colors[:, :3] if visual.kind == 'vertex' else None
    return surface_to_msg(mesh.vertices, mesh.faces, colors, shape.header)
