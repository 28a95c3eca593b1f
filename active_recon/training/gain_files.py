"""Gains of a dataset's objects, measured once and kept in files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.cluster import Crew
from active_recon.cluster.local import LocalCrew
from active_recon.cluster.telling import told
from active_recon.config import Config
from active_recon.datasets.layout import list_objects, ObjectFolder
from active_recon.errors import ConfigError, DataError, WorkError
from active_recon.evaluation.next_view.renderings import another_rendering
from active_recon.evaluation.next_view.watching import WatchedObject
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.scene import read_scene
from active_recon.json_text import json_value
from active_recon.policies import load_policy, Policy, PolicyOptions
from active_recon.reporting import Advance
from active_recon.training.checkpoints import differences
from active_recon.training.view_gains import (
    by_gain,
    by_policy,
    Chooser,
    measure_gains,
    some_views,
    spread_views,
    ViewGains,
)
from active_recon.volumes.voxels import FINE_RESOLUTION, RESOLUTION
from active_recon.whole_files import whole_file
import numpy as np
import torch

_MIXED = ('random', 'farthest', 'uniform')
_FEWEST = 3  # candidates that leave a choice after the first view
_NOTE = 'collected.json'
_LEFT_OUT = {'data', 'mesh'}  # kinds of errors of objects that cannot be read
_BY_GAIN = 0.4  # share of the episodes in which the best view is taken, where no policy is given


@dataclass(frozen=True)
class Collecting(Config):
    """
    What is measured of each object.

    - objects: at most so many of a folder; candidates: views of an object that are kept, all of
      which are candidates
    - starts: episodes of an object; views: of the longest of them; all but its last view give a
      state
    """

    objects: int = 200
    candidates: int = 8
    starts: int = 2
    views: int = 5
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Reject numbers that leave no choice."""
        if min(self.objects, self.starts) < 1 or self.views < 2 or self.candidates < _FEWEST:
            raise ConfigError('Collecting: no choice left: expected 1 object, 1 start, 2 views '
                              f'and 3 candidates or more, got {self.objects}, {self.starts}, '
                              f'{self.views} and {self.candidates}')


def drawn_objects(data: Path, most: int, number: int = 1) -> list[ObjectFolder]:
    """
    Return at most so many objects of a folder for a round, from 1 on, drawn by their names.

    Each round goes on where the one before ended, and begins again where there are no more.
    """
    drawn = sorted(list_objects(data), key=_key)
    first = (number - 1) * most % max(len(drawn), 1)
    return (drawn[first:] + drawn[:first])[:most]


def collect_gains(folders: Sequence[ObjectFolder], entrant: Entrant, collecting: Collecting,
                  out: Path, policy: Policy | None = None,
                  advance: Advance = lambda steps, note: None,
                  crew: Crew | None = None,
                  chosen_by: Mapping[str, Any] | None = None) -> tuple[list[Path], list[str]]:
    """
    Measure the gains of objects into files; return these, and why objects are left out.

    Files that are there already are kept. Views are chosen by the policy, or by a mixture of
    random, farthest, an even sweep and the greatest gain. Each object is shown under a light,
    noise and pose errors of its own. Objects that cannot be read are left out. Raises DataError
    where none is left or the note of how gains were collected is damaged, and ConfigError where
    gains of another network, or collected otherwise, are there. `crew` does the work; None: this
    process.
    """
    _keep_apart(out, {'network_sha256': entrant.weights, **collecting.to_dict(),
                      **(chosen_by or {})})
    keep = partial(_keep, entrant, collecting, out, policy, torch.get_num_threads())
    workers = crew or LocalCrew(1)
    results = workers.map(keep, folders, out, sorted({folder.root for folder in folders}))
    left_out = []
    for result in told(results, workers, advance):
        if result.refusal and result.kind not in _LEFT_OUT:
            raise WorkError(f'{folders[result.index].name}: {result.refusal}', result.kind)
        if result.refusal:
            *_, reason = result.refusal.splitlines()  # after that its dataset, of one, has none
            left_out.append(reason.strip())
    files = [path for folder in folders if (path := _file(out, folder)).is_file()]
    if not files:
        reasons = '\n  '.join(['got none', *sorted(left_out)])
        raise DataError(f'{out}: no object whose gains can be measured: expected one or more '
                        f'with voxels and {_FEWEST} images, {reasons}')
    return files, sorted(left_out)


def _keep_apart(out: Path, collected: dict[str, Any]) -> None:
    """
    Note beside gains how they are collected; raise ConfigError where they were otherwise.

    How many objects there may be is no difference: the gains of each are its own.
    """
    noted = out / _NOTE
    if not noted.is_file():
        out.mkdir(parents=True, exist_ok=True)
        with whole_file(noted) as unfinished:
            unfinished.write_text(json.dumps(collected) + '\n')
        return
    try:
        before = dict(json_value(noted.read_text()))
    except (ValueError, TypeError) as error:
        raise DataError(f'{noted}: no readable note of how gains were collected: expected that of '
                        f'`train-policy`, got: {error}; name another folder with --out') from error
    asked = {name: collected.get(name) for name in before}  # older notes tell less
    if differing := '; '.join(differences(*({**each, 'objects': None}
                                            for each in (before, asked)))):
        raise ConfigError(f'{out}: gains that were measured otherwise are there: {differing}; '
                          'name another folder with --out')


def _file(out: Path, folder: ObjectFolder) -> Path:
    """Return where an object's gains are kept: by what it shows, as a dataset may be made anew."""
    shown = hashlib.sha256()
    # No hidden files, which a `render` that was killed leaves there
    for path in (*sorted(folder.images_folder.glob('[!.]*')),
                 *(folder.voxels_path(side) for side in (RESOLUTION, FINE_RESOLUTION))):
        if path.is_file() and not path.name.endswith('_depth.png'):
            shown.update(path.read_bytes())
    return out / f'{folder.category}__{folder.name}-{shown.hexdigest()[:12]}.npz'


def _keep(entrant: Entrant, collecting: Collecting, out: Path, policy: Policy | None,
          threads: int, folder: ObjectFolder) -> None:
    """Measure the gains of an object into its file, unless they are there; raises DataError."""
    path = _file(out, folder)
    if not path.is_file():
        torch.set_num_threads(threads)
        _measured(folder, entrant, collecting, policy).save(path)


def _measured(folder: ObjectFolder, entrant: Entrant, collecting: Collecting,
              policy: Policy | None) -> ViewGains:
    seed = int.from_bytes(_key(folder)[:6], 'big')
    rng = np.random.default_rng(seed)
    scene = read_scene([folder], [entrant.network])
    if scene.view_count < _FEWEST:
        raise DataError(f'{folder.images_folder}: no choice of views: expected {_FEWEST} or more, '
                        f'got {scene.view_count}')
    shown = scene.framed[entrant.network.image_size]
    views = some_views(shown, spread_views(scene.view_count, collecting.candidates, rng))
    side = max(side for side in entrant.sides if side in scene.truths)
    watched = WatchedObject(
        entrant.network, another_rendering(views, seed % 2 ** 31), scene.truths[side][0],
        entrant.thresholds[side], collecting.bfloat16)
    chooser = _mixed(rng) if policy is None else by_policy(policy)
    return measure_gains(watched, chooser, collecting.starts, collecting.views, rng)


def _mixed(rng: np.random.Generator) -> Chooser:
    """Return the chooser of one episode, drawn."""
    if rng.random() < _BY_GAIN:
        return by_gain
    return by_policy(load_policy(str(rng.choice(_MIXED)), PolicyOptions(rng)))


def _key(folder: ObjectFolder) -> bytes:
    return hashlib.sha256(folder.full_name.encode()).digest()
