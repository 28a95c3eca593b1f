"""Parametric CAD categories: endless objects with their fronts at +x, and nothing to download."""

from collections.abc import Callable
import hashlib
from importlib import import_module
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.volumes.meshes import fit_to_grid
import numpy as np
import trimesh

# The paper's thirteen, and the three that are never trained on
CATEGORIES = ('airplane', 'bench', 'cabinet', 'car', 'cellphone', 'chair', 'firearm', 'lamp',
              'monitor', 'sofa', 'speaker', 'table', 'watercraft')
UNSEEN_CATEGORIES = ('bed', 'bookshelf', 'motorbike')
ALL_CATEGORIES = CATEGORIES + UNSEEN_CATEGORIES
# What is none of them: things of every kind, made where they are asked for by name
THINGS = ('thing',)


def check_category(category: str) -> None:
    """Raise ConfigError unless shapes of a category can be made."""
    if category not in ALL_CATEGORIES + THINGS:
        raise ConfigError('unknown category: expected one of '
                          f'{", ".join(ALL_CATEGORIES + THINGS)}, got {category!r}')


def make_shape(category: str, seed: int) -> trimesh.Trimesh:
    """
    Return one object of a category, coloured, fitted to the grid; the same for the same seed.

    Each category is a package with a module `generator` and in it a function of the category's
    name, `(rng) -> Trimesh`, that draws structure, proportions and materials.
    """
    check_category(category)
    module = 'things' if category in THINGS else f'{category}.generator'
    generate: Callable[[np.random.Generator], trimesh.Trimesh] = getattr(
        import_module(f'{__name__}.{module}'), category)
    salt = int.from_bytes(hashlib.sha256(category.encode()).digest()[:4], 'big')
    return fit_to_grid(generate(np.random.default_rng([salt, seed])))


def generators_hash() -> str:
    """Return the SHA-256 of the generators' code: data made under one hash is the same data."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for source in sorted(folder.rglob('*.py')):
        name = source.relative_to(folder).as_posix()
        digest.update(name.encode() + b'\0' + source.read_bytes())
    return digest.hexdigest()
