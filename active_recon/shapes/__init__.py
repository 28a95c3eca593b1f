"""Parametric CAD categories: endless objects with their fronts at +x, and nothing to download."""

from collections.abc import Callable
import hashlib
from importlib import import_module
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.meshes import fit_to_grid
import numpy as np
import trimesh

# The paper's thirteen, and the three that are never trained on
CATEGORIES = ('airplane', 'bench', 'cabinet', 'car', 'cellphone', 'chair', 'firearm', 'lamp',
              'monitor', 'sofa', 'speaker', 'table', 'watercraft')
UNSEEN_CATEGORIES = ('bed', 'bookshelf', 'motorbike')
ALL_CATEGORIES = CATEGORIES + UNSEEN_CATEGORIES


def make_shape(category: str, seed: int) -> trimesh.Trimesh:
    """
    Return one object of a category, coloured, fitted to the grid; the same for the same seed.

    Each category is a module of this package with a function of its own name,
    `(rng) -> Trimesh`, that draws structure, proportions and materials.
    """
    if category not in ALL_CATEGORIES:
        raise ConfigError('expected a category out of '
                          f'{", ".join(ALL_CATEGORIES)}, got {category!r}')
    generate: Callable[[np.random.Generator], trimesh.Trimesh] = getattr(
        import_module(f'{__name__}.{category}'), category)
    salt = int.from_bytes(hashlib.sha256(category.encode()).digest()[:4], 'big')
    return fit_to_grid(generate(np.random.default_rng([salt, seed])))


def generators_hash() -> str:
    """Return the SHA-256 of the generators' code: data made under one hash is the same data."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob('*.py')):
        digest.update(source.name.encode() + b'\0' + source.read_bytes())
    return digest.hexdigest()
