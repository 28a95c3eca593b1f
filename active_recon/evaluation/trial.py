"""A frozen network on the same episodes for every policy, with cached results."""

from collections.abc import Callable
from dataclasses import dataclass, fields
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.datasets.views import ViewSet
from active_recon.errors import DataError
from active_recon.evaluation.measure import Episodes, joined, run_oracle, run_policy
from active_recon.evaluation.metrics import episodes
from active_recon.evaluation.rollouts import batches
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import state_hash
from active_recon.npz_files import read_npz
from active_recon.plugins import code_hash
from active_recon.policies import Policy
from active_recon.policies.checked import naming
from active_recon.whole_files import whole_file
import numpy as np
from numpy.typing import NDArray
from torch import Tensor

_BLOCK = 2400  # episodes per cached file: the most that an interrupted run loses


@dataclass(frozen=True, eq=False)
class Contender:
    """
    A policy with one seed.

    `make` builds it from a random generator; None stands for the greedy oracle, which is not a
    policy, since it uses the truth. `key` identifies its results on disk, with `code`, the hash
    of a policy's own code.
    """

    policy: str
    key: str
    make: Callable[[np.random.Generator], Policy] | None
    code: str = ''


class Trial:
    """
    A frozen network, its threshold, and the objects of a set, each with several first views.

    - starts: number of first views of each object, of 24
    - count: number of views of an episode
    - seed: of the first views
    - bfloat16: the network runs in mixed precision
    - cache: folder that caches episodes, or None; the subfolder's name is a hash of everything
      that they depend on (the network's weights and, where it is one's own, its code, the data,
      the numbers above)
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
        if own := code_hash(network):
            self.identity['code'] = own
        self.folder = cache and _folder(cache, self.identity)

    @property
    def blocks(self) -> int:
        """The number of blocks that episodes are cached in."""
        return len(self._parts())

    def run(self, contender: Contender,
            progress: Callable[[int], None] = lambda done: None) -> Episodes:
        """Run a contender's episodes, or read them from the cache; raises DataError if damaged."""
        parts = []
        for block, part in enumerate(self._parts()):
            path = self.cached(contender, block)
            if path and path.is_file():
                parts.append(Episodes(**read_arrays(path, {each.name
                                                           for each in fields(Episodes)})))
                progress(len(part))
                continue
            parts.append(self.run_block(contender, block, progress))
            if path:
                write_arrays(path, **vars(parts[-1]))
        return joined(parts)

    def cached(self, contender: Contender, block: int) -> Path | None:
        """Return the path of a block's episodes in the cache; None where there is no cache."""
        name = f'{contender.key}{contender.code[:16]}-{block:03d}.npz'
        return self.folder and self.folder / name

    def run_block(self, contender: Contender, block: int,
                  progress: Callable[[int], None] = lambda done: None) -> Episodes:
        """Run the episodes of one block; they do not depend on other blocks."""
        part = self._parts()[block]
        objects, starts = self.objects[part], self.starts[part]
        if contender.make is None:
            return run_oracle(self.network, self.views, objects, starts, self.threshold,
                              self.count, self.bfloat16, progress)
        # A generator for each block makes interrupted and uninterrupted runs equal
        policy = contender.make(np.random.default_rng([*contender.key.encode(), block]))
        with naming(contender.policy):
            return run_policy(self.network, policy, self.views, objects, starts, self.threshold,
                              self.count, None, self.bfloat16, progress)

    def _parts(self) -> list[Tensor]:
        return [*batches(len(self.objects), _BLOCK)]


def data_hash(views: ViewSet) -> str:
    """Return the SHA-256 of a set's images, what they show of the cubes, cameras and voxels."""
    digest = hashlib.sha256()
    seen = () if views.seen is None else (views.seen,)
    for part in (views.images, views.poses, views.intrinsics, views.voxels, *seen):
        digest.update(str(tuple(part.shape)).encode())
        digest.update(part.contiguous().numpy().data)
    return digest.hexdigest()


def read_arrays(path: Path, names: set[str]) -> dict[str, NDArray[np.float64]]:
    """Read cached arrays; raises DataError where the file is damaged or lacks one of them."""
    try:
        return read_npz(path, names)
    except (OSError, ValueError) as error:
        raise DataError(f'{path}: no readable result of an earlier run: expected the arrays '
                        f'{", ".join(sorted(names))}, got: {error}; delete it to measure '
                        'again') from error


def write_arrays(path: Path, **arrays: NDArray[Any]) -> None:
    """Write arrays to a cache file, atomically."""
    with whole_file(path) as unfinished, unfinished.open('wb') as file:
        np.savez(file, allow_pickle=False, **arrays)


def _folder(cache: Path, identity: dict[str, Any]) -> Path:
    text = json.dumps(identity, indent=1)
    folder = cache / hashlib.sha256(text.encode()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'identity.json').write_text(text + '\n')
    return folder
