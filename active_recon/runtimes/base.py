"""The seam between a network and what runs it: named arrays in, named arrays out."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, TYPE_CHECKING

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # it brings OpenCV, for which no list of policies need wait
    from active_recon.geometry.canonical import NetworkSpec

State = Mapping[str, NDArray[np.float32]]
"""What a network or a policy knows after some views: named arrays, batch first."""

RUNTIMES: Mapping[str, str] = {'torch': 'active_recon.runtimes.torch'}
"""
The module of each runtime, which offers `load_network` and `load_policy`; imported when asked for.
"""


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

    `facts` are the model's constants that a policy needs, by name.
    """

    @property
    def facts(self) -> Mapping[str, Any]: ...

    def initial_state(self, batch: int) -> State:
        """Return the state before any view."""
        ...

    def step(self, inputs: Mapping[str, NDArray[np.float32]],
             state: State) -> tuple[Mapping[str, NDArray[np.float32]], State]:
        """Return the model's outputs after a view, (B, ...) each, and the next state."""
        ...


def load_runtime(weights: Path | None = None, runtime: str = 'torch', device: str = 'cpu',
                 threads: int | None = None) -> Runtime:
    """
    Return a runtime of the network in a weights file; None: those that ship.

    `threads` is the number of CPU threads; None is the library's default. Raises WeightsError,
    and ConfigError on a runtime or a device that is not available.
    """
    loaded: Runtime = _module(runtime).load_network(weights, device, threads)
    return loaded


def load_policy_runtime(weights: Path | None = None, runtime: str = 'torch', device: str = 'cpu',
                        threads: int | None = None) -> PolicyRuntime:
    """Return a runtime of the learned policy in a weights file; raises as `load_runtime`."""
    loaded: PolicyRuntime = _module(runtime).load_policy(weights, device, threads)
    return loaded


def _module(runtime: str) -> Any:
    if runtime not in RUNTIMES:
        raise ConfigError(f'runtime: unknown value: expected one of {", ".join(RUNTIMES)}, '
                          f'got {runtime!r}')
    return import_module(RUNTIMES[runtime])
