"""The seam between a network and what runs it: named arrays in, named arrays out."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, TYPE_CHECKING

from active_recon.errors import ConfigError, WeightsError
from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import SEGMENTER
from active_recon.runtimes.graph_files import (
    DEPTH_PART,
    is_exported,
    NETWORK_PARTS,
    POLICY_PART,
    SEGMENT_PART,
)
from active_recon.runtimes.precision import require_precision
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # it brings OpenCV, for which no list of policies need wait
    from active_recon.geometry.canonical import NetworkSpec

State = Mapping[str, NDArray[np.float32]]
"""What a network or a policy knows after some views: named arrays, batch first."""

RUNTIMES: Mapping[str, str] = {
    name: f'active_recon.runtimes.{name}' for name in ('openvino', 'torch', 'onnxruntime')}
"""
The module of each runtime, which offers `load_network`, `load_policy`, `load_depth` and
`load_segmenter`; imported when asked for.
"""
AUTO = 'auto'
RUNTIME_CHOICES = (AUTO, *RUNTIMES)
REMARK = 'remark'
"""The key of what a runtime's provenance says to the user, where it is not the one wished for."""


class Runtime(Protocol):
    """
    Runs a reconstruction network for one object, view by view.

    - spec: what the network asks of its images, and what it gives
    - threshold: the occupancy above which its weights call a cell occupied
    - provenance: what diagnostics and bags tell of it, by names such as `weights_sha256`
    """

    @property
    def spec(self) -> 'NetworkSpec': ...

    @property
    def threshold(self) -> float: ...

    @property
    def provenance(self) -> Mapping[str, str]: ...

    def initial_state(self) -> State:
        """Return the state before any view."""
        ...

    def step(self, image: NDArray[np.uint8], camera: Camera,
             state: State) -> tuple[NDArray[np.float32], NDArray[np.float32], State]:
        """
        Update the state by an image (S, S, 3) uint8 RGB of the spec's size, and its camera.

        If the network needs no front, a fourth channel may be given: 255 where the camera saw the
        pixel, else 0. The camera's distance is in sides of the grid; its azimuth is relative to
        the object's front where the spec needs one. Returns the occupancy (R, R, R) in [0, 1],
        the latent (C, h, w), and the next state.
        """
        ...

    def warm_up(self) -> None:
        """Run once, so that the first view is as fast as the others."""
        ...


class PolicyRuntime(Protocol):
    """
    Runs the model of a learned view policy for B episodes at once.

    - facts: the model's constants that a policy needs, by name
    - provenance: what diagnostics tell of it
    """

    @property
    def provenance(self) -> Mapping[str, str]: ...

    @property
    def facts(self) -> Mapping[str, Any]: ...

    def initial_state(self, batch: int) -> State:
        """Return the state before any view."""
        ...

    def step(self, inputs: Mapping[str, NDArray[np.float32]],
             state: State) -> tuple[Mapping[str, NDArray[np.float32]], State]:
        """Return the model's outputs after a view, (B, ...) each, and the next state."""
        ...


class DepthRuntime(Protocol):
    """
    Works what depth images saw into the occupancy of a network, for one object.

    - provenance: what diagnostics tell of it
    """

    @property
    def provenance(self) -> Mapping[str, str]: ...

    def refine(self, occupancy: NDArray[np.float32], evidence: NDArray[np.float32],
               state: State) -> NDArray[np.float32]:
        """
        Return the occupancy (R, R, R) corrected by `evidence` (3, R, R, R).

        See `depth_evidence` for the latter. `occupancy` and `state` are the network's.
        """
        ...


class SegmenterRuntime(Protocol):
    """
    Finds the object in an image around its cube.

    - image_size: S, side of its images in pixels
    - provenance: what diagnostics tell of it
    """

    @property
    def image_size(self) -> int: ...

    @property
    def provenance(self) -> Mapping[str, str]: ...

    def segment(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """
        Return how likely each pixel is the object's, (S, S) in [0, 1].

        Takes (S, S, 3 or 4) uint8 RGB; the fourth channel is 255 where the camera saw the pixel.
        """
        ...


def load_runtime(weights: Path | None = None, runtime: str = AUTO, device: str = 'cpu',
                 threads: int | None = None, precision: str = 'auto') -> Runtime:
    """
    Return a runtime of the network in a weights file; None: those that ship.

    `auto` is openvino where these very weights are exported beside them, else torch. Where an
    export is there and cannot be used, or not in the precision that is asked for, `auto` takes
    torch or the precision auto, and the provenance's `remark` says why. `threads` is the number
    of CPU threads; None is the library's default. `precision` is one of `precision.PRECISIONS`.
    Raises WeightsError, and ConfigError on a runtime, a device or a precision that is not
    available, and on less than one thread.
    """
    loaded: Runtime = _loaded('load_network', NETWORK_PARTS, weights, runtime, device, threads,
                              precision)
    return loaded


def load_policy_runtime(weights: Path | None = None, runtime: str = AUTO, device: str = 'cpu',
                        threads: int | None = None, precision: str = 'auto') -> PolicyRuntime:
    """Return a runtime of the learned policy in a weights file; see `load_runtime`."""
    loaded: PolicyRuntime = _loaded('load_policy', (POLICY_PART,), weights, runtime, device,
                                    threads, precision)
    return loaded


def load_depth_runtime(weights: Path | None = None, runtime: str = AUTO, device: str = 'cpu',
                       threads: int | None = None, precision: str = 'auto') -> DepthRuntime:
    """Return a runtime of the depth refiner beside a weights file; see `load_runtime`."""
    loaded: DepthRuntime = _loaded('load_depth', (DEPTH_PART,), weights, runtime, device, threads,
                                   precision)
    return loaded


def load_segmenter_runtime(weights: Path | None = None, runtime: str = AUTO, device: str = 'cpu',
                           threads: int | None = None, precision: str = 'auto'
                           ) -> SegmenterRuntime:
    """Return a runtime of a segmenter; None: of the one that ships. See `load_runtime`."""
    loaded: SegmenterRuntime = _loaded('load_segmenter', (SEGMENT_PART,), weights or SEGMENTER,
                                       runtime, device, threads, precision)
    return loaded


def _loaded(what: str, parts: Sequence[str], weights: Path | None, runtime: str, device: str,
            threads: int | None, precision: str) -> Any:
    require_precision(precision)
    if threads is not None and threads < 1:
        raise ConfigError(f'threads: too few: expected 1 or more, got {threads}')
    if runtime == AUTO:
        return _loaded_by_choice(what, parts, weights, device, threads, precision)
    if runtime not in RUNTIMES:
        raise ConfigError(f'runtime: unknown value: expected one of {", ".join(RUNTIME_CHOICES)}, '
                          f'got {runtime!r}')
    return getattr(import_module(RUNTIMES[runtime]), what)(weights, device, threads, precision)


def _loaded_by_choice(what: str, parts: Sequence[str], weights: Path | None, device: str,
                      threads: int | None, precision: str) -> Any:
    if device != 'cpu' or not is_exported(weights, parts):
        return _loaded(what, parts, weights, 'torch', device, threads, precision)
    remark = ''
    for tried in (precision,) if precision in (AUTO, 'f32') else (precision, AUTO):
        try:
            loaded = _loaded(what, parts, weights, 'openvino', device, threads, tried)
            return _with_remark(loaded, remark)
        except (ConfigError, WeightsError) as error:
            reason = error
            remark = f'the precision auto instead of {precision}: {error}'
    loaded = _loaded(what, parts, weights, 'torch', device, threads, 'f32')
    return _with_remark(loaded, f'the runtime torch instead of openvino: {reason}')


def _with_remark(loaded: Any, remark: str) -> Any:
    remarks = [remark, loaded.provenance.get(REMARK)]
    if any(remarks):
        loaded.provenance = {**loaded.provenance, REMARK: '; '.join(filter(None, remarks))}
    return loaded
