"""One frozen network on the same episodes for every policy; what was run once is kept."""

from collections.abc import Callable
from dataclasses import dataclass, fields
import hashlib
import json
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.evaluation.measure import Episodes, joined, run_oracle, run_policy
from active_recon.evaluation.metrics import episodes
from active_recon.evaluation.rollouts import batches
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import state_hash
from active_recon.policies import Policy
import numpy as np
from numpy.typing import NDArray
from torch import Tensor

_BLOCK = 2400  # episodes that are kept at once: a run that was cut off loses no more


@dataclass(frozen=True, eq=False)
class Contender:
    """
    A policy under one seed.

    `make` builds it, given a generator; None is the greedy oracle, which is no policy, since it is
    given the truth. `key` identifies its results on disk.
    """

    policy: str
    key: str
    make: Callable[[np.random.Generator], Policy] | None


class Trial:
    """
    A frozen network, its threshold, and the objects of a set, each from several first views.

    - starts: first views of each object; 24 are all
    - count: views of an episode
    - seed: draws the first views
    - bfloat16: the network runs in half precision where that is safe
    - cache: a folder in which episodes are kept, or None; whatever they depend on (the network's
      weights, the data, the numbers above) is part of their folder's name
    """

    def __init__(self, network: ReconstructionNetwork, threshold: float, views: ViewSet,
                 starts: int = 24, count: int = 5, seed: int = 0, bfloat16: bool = False,
                 cache: Path | None = None) -> None:
        self.network, self.threshold, self.views = network, threshold, views
        self.count, self.bfloat16 = count, bfloat16
        self.objects, self.starts = episodes(views, starts, seed)
        self.identity: dict[str, Any] = {
            'network': state_hash(network), 'threshold': threshold, 'data': data_hash(views),
            'starts': starts, 'views': count, 'seed': seed, 'bfloat16': bfloat16}
        self.folder = cache and _folder(cache, self.identity)

    def run(self, contender: Contender,
            progress: Callable[[int], None] = lambda done: None) -> Episodes:
        """Run a contender's episodes, or read those that were kept."""
        parts = []
        for block, part in enumerate(batches(len(self.objects), _BLOCK)):
            path = self.folder and self.folder / f'{contender.key}-{block:03d}.npz'
            if path and path.is_file():
                parts.append(Episodes(**read_arrays(path, {each.name
                                                           for each in fields(Episodes)})))
                progress(len(part))
                continue
            parts.append(self._run(contender, part, block, progress))
            if path:
                write_arrays(path, **vars(parts[-1]))
        return joined(parts)

    def _run(self, contender: Contender, part: Tensor, block: int,
             progress: Callable[[int], None]) -> Episodes:
        objects, starts = self.objects[part], self.starts[part]
        if contender.make is None:
            return run_oracle(self.network, self.views, objects, starts, self.threshold,
                              self.count, self.bfloat16, progress)
        # Each block draws by itself, so that a run that goes on draws what one in one go does
        policy = contender.make(np.random.default_rng([*contender.key.encode(), block]))
        return run_policy(self.network, policy, self.views, objects, starts, self.threshold,
                          self.count, None, self.bfloat16, progress)


def data_hash(views: ViewSet) -> str:
    """Return the SHA-256 of what a set shows and of its truth."""
    digest = hashlib.sha256()
    for part in (views.images, views.poses, views.intrinsics, views.voxels):
        digest.update(str(tuple(part.shape)).encode())
        digest.update(part.contiguous().numpy().data)
    return digest.hexdigest()


def read_arrays(path: Path, names: set[str]) -> dict[str, NDArray[np.float64]]:
    """Read arrays that were kept; raises DataError where they are not whole."""
    try:
        with np.load(path) as stored:
            return {name: stored[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
        raise DataError(f'{path}: no readable result of an earlier run: expected the arrays '
                        f'{", ".join(sorted(names))}, got: {error}; delete it to have it made '
                        'anew') from error


def write_arrays(path: Path, **arrays: NDArray[Any]) -> None:
    """Keep arrays, in one move."""
    unfinished = path.with_suffix('.part')
    with unfinished.open('wb') as file:
        np.savez(file, allow_pickle=False, **arrays)
    unfinished.replace(path)


def _folder(cache: Path, identity: dict[str, Any]) -> Path:
    text = json.dumps(identity, indent=1)
    folder = cache / hashlib.sha256(text.encode()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'identity.json').write_text(text + '\n')
    return folder
