"""The network and the planner that a run was made with, found again by what its bag says."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
import math
from pathlib import Path
from typing import Any

from active_recon.acquisition.motion import MotionLimits
from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import WeightsError
from active_recon.geometry.cameras import CANONICAL_DISTANCE
from active_recon.models.weights_files import find_weights, FOLDER, SHIPPED, weights_hash
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor

_OF_RECONSTRUCTOR = ('object_size', 'object_yaw', 'threshold')
_OF_LIMITS = tuple(field.name for field in fields(MotionLimits))
_OF_PLANNER = ('policy', 'seed', 'max_views', 'entropy_tolerance', 'object_yaw', 'motion_weight',
               'elevation', 'distance', *_OF_LIMITS)


@dataclass(frozen=True)
class Settings:
    """
    What the loop was started with; what is missing in the mappings is the core's default.

    `planner` is None where nothing tells which policy chose.
    """

    weights: Path
    reconstructor: Mapping[str, Any]
    planner: Mapping[str, Any] | None
    threads: int = 1

    def under(self, weights: Path | None = None, policy: str | None = None,
              threshold: float | None = None) -> 'Settings':
        """Return the settings with another model, policy or threshold; None keeps what was."""
        reconstructor = dict(self.reconstructor)
        if weights is not None:
            reconstructor.pop('threshold', None)  # each model has its own
        if threshold is not None:
            reconstructor['threshold'] = threshold
        planner = None if self.planner is None else dict(self.planner)
        if policy is not None:
            yaw = {name: reconstructor[name] for name in ('object_yaw',) if name in reconstructor}
            planner = {**yaw, 'weights': self.weights, **(planner or {}), 'policy': policy}
        if planner is not None and weights is not None:
            planner['weights'] = weights
        return replace(self, weights=weights or self.weights, reconstructor=reconstructor,
                       planner=planner)

    def load_reconstructor(self) -> Reconstructor:
        """Raise WeightsError or ConfigError where it cannot be."""
        return Reconstructor.load(self.weights, threads=self.threads, **self.reconstructor)

    def load_planner(self) -> Planner | None:
        """Return None where nothing tells which policy chose; raise as the reconstructor does."""
        if self.planner is None:
            return None
        limits = MotionLimits(**{name: self.planner[name] for name in _OF_LIMITS
                                 if name in self.planner})
        place = {'distance': CANONICAL_DISTANCE * self.reconstructor.get('object_size', 1.0)}
        return Planner.load(limits=limits, threads=self.threads, **place | {
            name: value for name, value in self.planner.items() if name not in _OF_LIMITS})


def recorded_settings(run: RecordedRun, weights: Path | None = None, instead: bool = False,
                      given: Mapping[str, float | None] | None = None) -> Settings:
    """
    Return what a run was made with, by its parameters and the hash of its weights.

    `weights`: a file to look at first, or, with `instead`, to be taken whatever was recorded.
    `given`: `object_size` in metres and `object_yaw` in radians where the bag does not tell, or
    tells what is not so; None: it does. Raises WeightsError where no file has the recorded hash,
    DataError where a parameter cannot be used.
    """
    placed = {name: value for name, value in (given or {}).items() if value is not None}
    size = _given(node_parameters(run, 'turntable_camera'), ('object_size',))
    of_reconstructor = {**size, **node_parameters(run, 'reconstructor'), **placed}
    of_planner = {**node_parameters(run, 'view_planner'), **placed}
    found = weights if weights and instead else _recorded_weights(
        run, weights, of_reconstructor.get('weights', ''))
    planner = None
    if 'policy' in of_planner:
        planner = _given(of_planner, _OF_PLANNER)
        own = of_planner.get('weights', '')
        same = own == of_reconstructor.get('weights', '')
        planner['weights'] = found if same else find_weights(own or None)
    return Settings(found, _given(of_reconstructor, _OF_RECONSTRUCTOR), planner,
                    of_reconstructor.get('threads', 1))


def _given(parameters: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return the named parameters that were given: NaN stands for one that was not."""
    return {name: value for name in names if (value := parameters.get(name)) is not None
            and not (isinstance(value, float) and math.isnan(value))}


def _named(parameter: str) -> Path | None:
    """Return the file that a node's parameter names, if it still ships where it is a name."""
    with suppress(WeightsError):
        return find_weights(parameter) if parameter else None
    return None


def _recorded_weights(run: RecordedRun, weights: Path | None, parameter: str) -> Path:
    wanted = run.provenance.get('weights_sha256')
    named = [path for path in (weights, _named(parameter)) if path]
    if wanted is None:
        return [*named, SHIPPED][0]
    for path in (*named, SHIPPED, *sorted(FOLDER.glob('*.safetensors'))):
        if path.is_file() and weights_hash(path) == wanted:
            return path
    raise WeightsError(
        f'{run.path}: expected the weights that it was recorded with, SHA-256 {wanted[:12]}..., '
        'but neither those that ship nor those that were named are: the weights have changed '
        'since. Name the file by --weights, or replay under others by --model')
