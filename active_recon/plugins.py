"""Networks and policies of one's own: from an installed package, or from a Python file."""

from collections.abc import Sequence
from functools import cache
import hashlib
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
import os
from pathlib import Path
import sys
from types import ModuleType
from typing import Any

from active_recon.errors import ConfigError

NETWORKS_GROUP, POLICIES_GROUP = 'active_recon.networks', 'active_recon.policies'
"""The groups of entry points under which packages offer theirs, each by its name."""
_OWN = '_own_'
"""What the name of a file's module begins with; its path follows, in hexadecimal digits."""


@cache
def installed(group: str) -> dict[str, Any]:
    """Return the entry points of a group by their names, none of them loaded yet."""
    return {point.name: point for point in entry_points(group=group)}


def load_installed(group: str, name: str) -> Any:
    """Return what an installed package offers; ConfigError where it cannot be imported."""
    try:
        return installed(group)[name].load()
    except Exception as error:  # whatever the package raises as it is imported
        raise ConfigError(f'{name}: cannot be imported from where {group} says: '
                          f'{type(error).__name__}: {error}') from error


def is_in_file(reference: str) -> bool:
    """Return whether a reference is of the form my_file.py:Net."""
    path, colon, name = reference.rpartition(':')
    return bool(colon) and path.endswith('.py') and name.isidentifier()


def load_from_file(reference: str) -> Any:
    """
    Return the object that a reference of the form my_file.py:Net names.

    Raises ConfigError where there is no such file, where it fails, or has no such name.
    """
    place, _, name = reference.rpartition(':')
    path = Path(place)
    if not path.is_file():
        raise ConfigError(f'{path}: no such file')
    spec = _spec_of(f'{_OWN}{os.fsencode(path.absolute()).hex()}')
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for themselves
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever the file raises
        raise ConfigError(f'{path}: fails with {type(error).__name__}: {error}') from error
    if not hasattr(module, name):
        raise ConfigError(f'{path}: has no {name}')
    return getattr(module, name)


def code_hash(made: object) -> str:
    """Return the SHA-256 of the file that an object's class is in; '' where that is ours."""
    name = type(made).__module__
    return '' if name.partition('.')[0] == __package__ else file_hash(name)


def file_hash(module: str) -> str:
    """Return the SHA-256 of the file of an imported module; '' where it has none."""
    path = getattr(sys.modules.get(module), '__file__', None)
    return '' if path is None else hashlib.sha256(Path(path).read_bytes()).hexdigest()


class _OwnFiles(MetaPathFinder):
    """Finds files that this process did not load: a worker gets networks of their classes."""

    def find_spec(self, fullname: str, path: Sequence[str] | None,
                  target: ModuleType | None = None) -> ModuleSpec | None:
        """Return the spec of a file's module; None of all others."""
        return _spec_of(fullname) if fullname.startswith(_OWN) else None


def _spec_of(name: str) -> ModuleSpec | None:
    return spec_from_file_location(name, os.fsdecode(bytes.fromhex(name.removeprefix(_OWN))))


sys.meta_path.append(_OwnFiles())
