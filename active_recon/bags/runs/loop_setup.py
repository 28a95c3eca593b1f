"""The network and the planner that a run was recorded with, restored from what its bag says."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
import math
from pathlib import Path
from typing import Any

from active_recon.acquisition.motion import MotionLimits
from active_recon.acquisition.motion_cost import TimedMotion
from active_recon.bags.runs.parameters import node_parameters
from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import WeightsError
from active_recon.geometry.cameras import CANONICAL_DISTANCE
from active_recon.models.weights_files import find_weights, FOLDER, SHIPPED, weights_hash
from active_recon.planner import Planner
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes import AUTO, RUNTIME_CHOICES

_OF_RECONSTRUCTOR = ('object_size', 'object_yaw', 'threshold')
_OF_LIMITS = tuple(field.name for field in fields(MotionLimits))
_OF_MOTION = tuple(field.name for field in fields(TimedMotion))
_OF_PLANNER = ('policy', 'seed', 'max_views', 'entropy_tolerance', 'target_quality', 'min_gain',
               'object_yaw', 'motion_weight', 'elevation', 'elevation_range', 'reachable_views',
               'distance', *_OF_LIMITS, *_OF_MOTION)


@dataclass(frozen=True)
class Overrides:
    """
    What to change of the recorded setup; None keeps what was recorded.

    `box` is another cube: x, y, z of its centre in the object frame and its side, metres.
    """

    weights: Path | None = None
    policy: str | None = None
    threshold: float | None = None
    box: tuple[float, float, float, float] | None = None

    @property
    def name(self) -> str:
        """The overrides as a part of a folder's name."""
        return '_'.join(word for word in (
            self.weights and self.weights.stem, self.policy,
            self.threshold and f'threshold-{self.threshold:g}',
            self.box and f'box-{self.box[3]:g}') if word)


@dataclass(frozen=True)
class LoopSetup:
    """
    What the loop was started with; names missing in the mappings have the core's defaults.

    `planner` is None if the bag does not say which policy chose the views. `threads`, `runtime`
    and `precision` are those of the network, and of a learned policy.
    """

    weights: Path
    reconstructor: Mapping[str, Any]
    planner: Mapping[str, Any] | None
    threads: int = 1
    runtime: str = AUTO
    precision: str = 'auto'

    def with_overrides(self, overrides: Overrides) -> 'LoopSetup':
        """Return the setup with another model, policy, threshold or side of the cube."""
        weights, policy = overrides.weights, overrides.policy
        reconstructor = dict(self.reconstructor)
        if weights is not None:
            reconstructor.pop('threshold', None)  # each model has its own
        if overrides.threshold is not None:
            reconstructor['threshold'] = overrides.threshold
        if overrides.box is not None:
            reconstructor['object_size'] = overrides.box[3]
        planner = None if self.planner is None else dict(self.planner)
        if policy is not None:
            yaw = {name: reconstructor[name] for name in ('object_yaw',) if name in reconstructor}
            planner = {**yaw, 'weights': self.weights, **(planner or {}), 'policy': policy}
        if planner is not None and weights is not None:
            planner['weights'] = weights
        return replace(self, weights=weights or self.weights, reconstructor=reconstructor,
                       planner=planner)

    def load_reconstructor(self) -> Reconstructor:
        """Return the reconstructor; raises WeightsError or ConfigError."""
        return Reconstructor.load(self.weights, threads=self.threads, runtime=self.runtime,
                                  precision=self.precision, **self.reconstructor)

    def load_planner(self) -> Planner | None:
        """Return the planner, None if the policy is unknown; raises WeightsError, ConfigError."""
        if self.planner is None:
            return None
        limits = MotionLimits(**_own(self.planner, _OF_LIMITS))
        motion = TimedMotion(**_own(self.planner, _OF_MOTION))
        place = {'distance': CANONICAL_DISTANCE * self.reconstructor.get('object_size', 1.0)}
        return Planner.load(
            limits=limits, motion=motion, threads=self.threads, runtime=self.runtime,
            precision=self.precision, **place | {
                name: value for name, value in self.planner.items()
                if name not in (*_OF_LIMITS, *_OF_MOTION)})


def recorded_setup(run: RecordedRun, weights: Path | None = None, any_weights: bool = False,
                   scene_parameters: Mapping[str, float | None] | None = None) -> LoopSetup:
    """
    Return what a run was recorded with, by its parameters and the hash of its weights.

    `weights`: the file, which has to have the recorded hash unless `any_weights`; None: whichever
    has it.
    `scene_parameters`: `object_size` in metres and `object_yaw` in radians, which replace the
    recorded ones; None keeps those. Raises WeightsError if there are no weights of the recorded
    hash, DataError if a parameter is invalid.
    """
    placed = {name: value for name, value in (scene_parameters or {}).items()
              if value is not None}
    size = _given(node_parameters(run, 'turntable_camera'), ('object_size',))
    of_reconstructor = {**size, **node_parameters(run, 'reconstructor'), **placed}
    of_planner = {**node_parameters(run, 'view_planner'), **placed}
    found = weights if weights and any_weights else _recorded_weights(
        run, weights, of_reconstructor.get('weights', ''))
    planner = None
    if 'policy' in of_planner:
        planner = _given(of_planner, _OF_PLANNER)
        planner['policy'] = of_planner.get('policy_in_use', planner['policy'])
        own = of_planner.get('weights', '')
        same = own == of_reconstructor.get('weights', '')
        planner['weights'] = found if same else find_weights(own or None)
    precision = _precision(run, of_reconstructor)
    if weights and any_weights and precision != 'f32':
        precision = 'auto'  # other weights need not be exported, and torch computes in f32 alone
    return LoopSetup(found, _given(of_reconstructor, _OF_RECONSTRUCTOR), planner,
                    of_reconstructor.get('threads', 1), _runtime(of_reconstructor), precision)


def _precision(run: RecordedRun, parameters: Mapping[str, Any]) -> str:
    """Return the precision that a run was computed in, also where what was asked for was auto."""
    asked = parameters.get('precision', 'auto')
    if asked != 'auto' or 'weights_sha256' not in run.provenance:
        return str(asked)
    # Bags before there was a choice do not tell it
    return 'bf16' if ', bf16,' in run.provenance.get('computed_by', '') else 'f32'


def _runtime(parameters: Mapping[str, Any]) -> str:
    """Return the runtime that was asked for; earlier bags have what it was, in words."""
    asked = parameters.get('runtime')
    return asked if asked in RUNTIME_CHOICES else AUTO


def _given(parameters: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return the named parameters that are set: NaN means 'not set'."""
    return {name: value for name in names if (value := parameters.get(name)) is not None
            and not (isinstance(value, float) and math.isnan(value))}


def _own(parameters: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    """Return those of the named parameters that there are."""
    return {name: parameters[name] for name in names if name in parameters}


def _named(parameter: str) -> Path | None:
    """Return the weights file that a node's parameter names, None if it is not there any more."""
    with suppress(WeightsError):
        return find_weights(parameter) if parameter else None
    return None


def _recorded_weights(run: RecordedRun, weights: Path | None, parameter: str) -> Path:
    wanted = run.provenance.get('weights_sha256')
    named = _named(parameter)
    if wanted is None:
        return weights or named or SHIPPED
    if weights is not None:
        _require_hash(weights, wanted)
        return weights
    for path in (*([named] if named else []), SHIPPED, *sorted(FOLDER.glob('*.safetensors'))):
        if path.is_file() and weights_hash(path) == wanted:
            return path
    raise WeightsError(
        f'{run.path}: weights not found: expected those of the recording, SHA-256 '
        f'{wanted[:12]}..., among the shipped ones, which have changed since. Give the file by '
        '--weights, or replay with another model by --model')


def _require_hash(weights: Path, wanted: str) -> None:
    if not weights.is_file():
        raise WeightsError(f'{weights}: no such file: expected the weights of the recording, '
                           f'SHA-256 {wanted[:12]}...')
    if (found := weights_hash(weights)) != wanted:
        raise WeightsError(
            f'{weights}: not the weights of the recording: expected SHA-256 {wanted[:12]}..., got '
            f'{found[:12]}...; --model replays with other weights')
