"""What is asked of every bag, and of which files its result is."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
import hashlib
import json
import os
from pathlib import Path
from typing import Any

from active_recon import __version__
from active_recon.bags.runs.loop_setup import Overrides
from active_recon.bags.runs.run import RecordedRun
from active_recon.bags.runs.scene import Scene
from active_recon.bags.runs.topics import Topics
from active_recon.cluster.stores import Place, Stored
from active_recon.errors import DataError
from active_recon.models.weights_files import depth_path, scorer_path, weights_hash
from active_recon.policies import policy_code, PolicyOptions
from active_recon.quality.tables import tables_path
from active_recon.report.truth import known_truth, Truth, TruthFile

KINDS = ('replay', 'report', 'measure')
_SHAPES = ('.binvox', '.glb', '.gltf', '.obj', '.ply', '.stl', '.off')


@dataclass(frozen=True)
class TruthSource:
    """
    A true shape for all bags, or a folder with one for each object, by its name.

    `fit`, `up` and `front` as in `TruthFile`.
    """

    path: Path
    fit: bool = False
    up: str | None = None
    front: str | None = None

    def read(self, run: RecordedRun, name: str, object_size: float | None,
             object_yaw: float | None = None) -> Truth | None:
        """
        Return the true shape of a run's object; None where a folder has none, and none is known.

        `name` is the object's, '' where it is not known.
        """
        path = self.path
        if path.is_dir():
            own = [file for suffix in _SHAPES if (file := path / f'{name}{suffix}').is_file()]
            if not own:
                return known_truth(run)
            path = own[0]
        return TruthFile(path, self.fit, self.up, self.front).read(run, object_size,
                                                                   object_yaw)

    @property
    def identity(self) -> dict[str, Any]:
        """What results depend on."""
        return {**asdict(self), 'path': str(self.path), 'files': files_of(self.path)}


@dataclass(frozen=True, eq=False)
class Task:
    """
    What is done with each bag: replayed, reported or measured, and with which options.

    `out` is the folder of the results: an absolute path, or a place in a store.
    """

    kind: str
    out: Place
    topics: Topics
    scene: Scene
    overrides: Overrides = Overrides()
    truth: TruthSource | None = None

    @property
    def identity(self) -> str:
        """A hash of all options that rows depend on."""
        weights, empty = self.overrides.weights, self.scene.empty_scene
        policy = self.overrides.policy
        text = json.dumps({
            'version': __version__, 'kind': self.kind, 'topics': repr(self.topics),
            'scene': repr([self.scene.parameters, self.scene.elevation,
                           self.scene.camera_position, self.scene.camera_orientation,
                           self.scene.object_position,
                           self.scene.background]),
            'empty_scene': None if empty is None else hashlib.sha256(
                empty.tobytes()).hexdigest(),
            'weights': None if weights is None else [weights_hash(weights), *map(
                _hash_of, (tables_path(weights), scorer_path(weights), depth_path(weights)))],
            'policy': policy and [policy, policy_code(policy, PolicyOptions(weights=weights))],
            'threshold': self.overrides.threshold,
            'truth': None if self.truth is None else self.truth.identity}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _hash_of(beside: Path) -> str:
    """Return the hash of what may lie beside weights; '' where it does not."""
    return weights_hash(beside) if beside.is_file() else ''


def state_of(bag: Place, identity: str) -> str:
    """
    Return a hash of the names, sizes and times of a bag's files, and of a task's identity.

    Raises DataError where there is no bag.
    """
    if isinstance(bag, Path) and not bag.exists():  # a store says so below, in one request less
        raise DataError(f'{bag}: no bag there: no such file or folder on {os.uname().nodename}',
                        'not_seen')
    text = json.dumps([identity, str(bag), files_of(bag)])
    return hashlib.sha256(text.encode()).hexdigest()


def files_of(place: Place) -> Mapping[str, tuple[int, int | str]]:
    """
    Return what tells that a file, or a folder's files, are others than before.

    That is the size, bytes, and the time of change, nanoseconds; in a store its hash or its time.
    """
    if isinstance(place, Stored):
        return {each.name: (each.size, each.changed)
                for each in sorted(place.entries(), key=lambda each: each.name)
                if not each.is_folder}
    files = sorted(each for each in place.iterdir() if each.is_file()) if place.is_dir() else [
        place] if place.exists() else []
    return {file.name: (file.stat().st_size, file.stat().st_mtime_ns) for file in files}
