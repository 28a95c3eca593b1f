"""The models that ship: real, CC0, and never trained on. CREDITS.md says whose they are."""

from pathlib import Path

from active_recon.errors import MeshError

_FOLDER = Path(__file__).parent


def shipped_objects() -> list[str]:
    """Return the names of the models that ship, sorted."""
    return sorted(path.stem for path in _FOLDER.glob('*.glb'))


def find_object(name_or_path: str) -> Path:
    """
    Return the file of a shipped model, by its name, or of any mesh, by its path.

    Raises MeshError where it is neither.
    """
    if name_or_path in shipped_objects():
        return _FOLDER / f'{name_or_path}.glb'
    path = Path(name_or_path)
    if not path.is_file():
        raise MeshError(f'{name_or_path}: no such mesh file, and none of '
                        f'{", ".join(shipped_objects())}')
    return path.absolute()
