"""A network and the state of one episode: the core of the reconstructor's node."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
import math
from pathlib import Path

from active_recon.errors import ConfigError, ViewError, WeightsError
from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import network_image, NetworkSpec, useful_reduction
from active_recon.models.weights_files import find_weights, SHIPPED
from active_recon.quality.judge import Judge
from active_recon.quality.quality import Quality
from active_recon.quality.silhouettes import SeenView
from active_recon.quality.tables import find_tables, QualityTables
from active_recon.runtimes import (
    AUTO,
    DepthRuntime,
    load_depth_runtime,
    load_runtime,
    Runtime,
    State,
)
from active_recon.volumes.depth_evidence import depth_evidence, Evidence, no_evidence
from active_recon.volumes.depth_images import DepthImage, usable_depth
from active_recon.volumes.voxels import turned, VoxelGrid
import numpy as np
from numpy.typing import NDArray

_COLORING_SIDE = 128  # an image twice as fine as that serves for photographs of 256 pixels
_COMPARED_VIEWS = 24
"""Views, the last ones, whose silhouettes are compared: a stream of views must not get slower."""


def _not_judged() -> None:
    """Return no quality; a function of its own, since lambdas are not pickled."""


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """
    The reconstruction after a view: the grid in the object frame, and the latent (C, h, w).

    `image` is the network's input, (S, S, 3 or 4) uint8; the fourth channel is 255 where the
    camera saw the pixel. `depth_refusal` says in one line why a depth image that was given was not
    used. `judge` computes the quality, which does not delay what needs none.
    """

    grid: VoxelGrid
    latent: NDArray[np.float32] = field(repr=False)
    image: NDArray[np.uint8] | None = field(default=None, repr=False)
    depth_refusal: str = ''
    judge: Callable[[], Quality | None] = field(default=_not_judged, repr=False)

    @cached_property
    def quality(self) -> Quality | None:
        """The quality, judged when it is first asked for; None without quality tables."""
        return self.judge()


@dataclass(frozen=True, eq=False)
class Progress:
    """
    What a reconstructor knows of an episode: the state, and what was seen of its views.

    `evidence` is that of its depth images, None where there was none.
    """

    state: State
    view_count: int
    seen: tuple[SeenView, ...]
    evidence: Evidence | None = None


class Reconstructor:
    """
    Integrates views of one object into its reconstruction.

    `object_size` is the side of the voxel grid in metres. `object_yaw` is the azimuth of the
    object's front in the object frame, radians. Only networks that predict with the front at +x
    use it. `threshold` None is that of the weights. `tables` None: quality is not judged.
    `load_depth` returns what works depth images in, and raises WeightsError where there is none;
    it is called when it is first needed. None: no depth is taken.
    """

    def __init__(self, runtime: Runtime, object_size: float = 1.0, object_yaw: float = 0.0,
                 threshold: float | None = None, tables: QualityTables | None = None,
                 load_depth: Callable[[], DepthRuntime] | None = None) -> None:
        if not 0 < object_size < math.inf:
            raise ConfigError('object_size: out of range: expected metres above 0, got '
                              f'{object_size}')
        if not math.isfinite(object_yaw):
            raise ConfigError(f'object_yaw: not finite: expected radians, got {object_yaw}')
        self._runtime = runtime
        self.set_threshold(threshold)
        self.object_size = object_size
        self._yaw = object_yaw if runtime.spec.needs_front else 0.0
        self._judge = None if tables is None else Judge(tables)
        self._load_depth = load_depth
        self._depth: DepthRuntime | None = None
        self.threads: int | None = None
        """CPU threads that it was loaded for; None: the runtime's default."""
        self.no_quality = ''
        """Why quality is not judged, in words, where it might be expected."""
        self.reset()

    @classmethod
    def load(cls, weights: Path | None = None, device: str = 'cpu', object_size: float = 1.0,
             object_yaw: float = 0.0, threshold: float | None = None,
             threads: int | None = None, runtime: str = AUTO,
             precision: str = 'auto') -> 'Reconstructor':
        """
        Load weights (None: those that ship), and the quality tables beside them if there are any.

        For `runtime` and `precision` see `load_runtime`. Raises WeightsError and ConfigError.
        """
        loaded = load_runtime(weights, runtime, device, threads, precision)
        tables, without = find_tables(
            weights or SHIPPED, loaded.provenance.get('weights_sha256', ''))
        reconstructor = cls(
            loaded, object_size, object_yaw, threshold, tables,
            lambda: load_depth_runtime(weights, runtime, device, threads, precision))
        reconstructor.threads, reconstructor.no_quality = threads, without
        return reconstructor

    @property
    def spec(self) -> NetworkSpec:
        """The images that the network takes, and the resolution that it predicts at."""
        return self._runtime.spec

    @property
    def provenance(self) -> Mapping[str, str]:
        """What diagnostics and bags record of the network and its runtime."""
        needs_front = str(self._runtime.spec.needs_front).lower()
        return {**self._runtime.provenance, 'needs_front': needs_front}

    @property
    def judges_quality(self) -> bool:
        """Whether reconstructions come with their quality."""
        return self._judge is not None

    @property
    def view_count(self) -> int:
        """Number of views since the episode began."""
        return self._view_count

    def set_threshold(self, threshold: float | None) -> None:
        """Set the occupancy above which a cell is occupied; None is that of the weights."""
        threshold = self._runtime.threshold if threshold is None else threshold
        if not 0 < threshold < 1:
            raise ConfigError('threshold: out of range: expected a probability in (0, 1), got '
                              f'{threshold}')
        self.threshold = float(threshold)

    def warm_up(self, depth: bool = False) -> None:
        """
        Run the network once, so that the first view is as fast as the others.

        With `depth`, also what works depth images in; raises WeightsError where there is none.
        """
        self._runtime.warm_up()
        if depth:
            side = self._runtime.spec.resolution
            self._depth_runtime().refine(np.zeros((side,) * 3, np.float32), no_evidence(side),
                                         self._runtime.initial_state())

    def _depth_runtime(self) -> DepthRuntime:
        if self._depth is None:
            if self._load_depth is None:
                raise WeightsError('no depth refiner: expected a reconstructor loaded with one')
            self._depth = self._load_depth()
        return self._depth

    def reset(self) -> None:
        """Clear the state for a new episode."""
        self._state = self._runtime.initial_state()
        self._view_count = 0
        self._evidence: Evidence | None = None
        self._seen: deque[SeenView] = deque(maxlen=_COMPARED_VIEWS)

    @property
    def object_yaw(self) -> float:
        """Azimuth of the object's front in the object frame, radians; 0 where it is not used."""
        return self._yaw

    def initial_state(self) -> State:
        """Return the network's state before any view."""
        return self._runtime.initial_state()

    @property
    def progress(self) -> Progress:
        """What is known of the episode, to go on from later."""
        return Progress(self._state, self._view_count, tuple(self._seen), self._evidence)

    def go_on_from(self, progress: Progress) -> None:
        """Take up an episode of a reconstructor with the same weights, size and yaw."""
        self.reset()
        self._state, self._view_count = progress.state, progress.view_count
        self._evidence = progress.evidence
        self._seen.extend(progress.seen)

    def reduction(self, camera: Camera) -> int:
        """
        Return by how much an image of a camera may be reduced before `add_view`: 8, 4, 2 or 1.

        The reconstruction is then nearly the same, and photographs for its colours as sharp.
        """
        return useful_reduction(camera, self.spec, self.object_size, _COLORING_SIDE)

    def add_view(self, image: NDArray[np.uint8], camera: Camera,
                 depth: DepthImage | None = None) -> Reconstruction:
        """
        Update the reconstruction by one view.

        Takes an image (H, W, 3) uint8 RGB, its camera in the object frame, and what a depth camera
        measured beside it. Depth that cannot be used is left out, and the result says why. Raises
        ViewError, and WeightsError where a state that was taken up needs a depth refiner; they
        leave the state unchanged.
        """
        if not isinstance(depth, DepthImage | None):
            raise ViewError('wrong depth: expected a DepthImage of active_recon.volumes.'
                            f'depth_images, got a {type(depth).__name__}; DepthImage(metres) '
                            'makes one', 'depth')
        if self._evidence is not None:
            self._depth_runtime()
        shown, seen_by = network_image(image, camera, self._runtime.spec, self.object_size)
        placed = seen_by.turned(-self._yaw).scaled(1 / self.object_size)
        occupancy, latent, state = self._runtime.step(shown, placed, self._state)
        latent = latent.copy()  # it may be a view of the state, which views to come begin with
        if not (np.isfinite(occupancy).all() and np.isfinite(latent).all()):
            raise ViewError('not finite: expected an occupancy and a latent of finite numbers '
                            'from the network, got others; take other weights, or precision f32',
                            'not_finite')
        self._state = state
        self._view_count += 1
        refusal = '' if depth is None else self._add_depth(depth, camera)
        if self._evidence is not None:
            occupancy = self._depth_runtime().refine(occupancy, self._evidence, self._state)
        grid = VoxelGrid(turned(occupancy, self._yaw), self.object_size)
        return Reconstruction(grid, latent, shown, refusal,
                              self._judgement(occupancy, latent, placed))

    def _add_depth(self, depth: DepthImage, camera: Camera) -> str:
        """Add the evidence of a view's depth image; return why it cannot be used, else ''."""
        try:
            self._depth_runtime()
            measured, seen_by = usable_depth(depth, camera, self.object_size)
        except (ViewError, WeightsError) as error:
            return str(error)
        side = self._runtime.spec.resolution
        new = depth_evidence(measured, seen_by, side)
        self._evidence = new if self._evidence is None else self._evidence + new
        return ''

    def _judgement(self, occupancy: NDArray[np.float32], latent: NDArray[np.float32],
                   camera: Camera) -> Callable[[], Quality | None]:
        """Return what judges the state after a view, from the network's frame."""
        if self._judge is None or 'foreground' not in self._state:
            return _not_judged
        foreground, seen = self._state['foreground'][0]
        self._seen.append(SeenView(camera, foreground.copy(), seen.copy()))
        return partial(self._judge.judge, occupancy, self.threshold, latent, tuple(self._seen),
                       self._view_count)


def load(model: str | Path | None = None, object_size: float = 1.0,
         threads: int | None = None) -> Reconstructor:
    """
    Return a reconstructor of a model that ships, by its name, or of a weights file.

    None is the default's; `object_size` the side of the voxel grid, metres. Raises WeightsError
    and ConfigError.
    """
    return Reconstructor.load(find_weights(model), object_size=object_size, threads=threads)
