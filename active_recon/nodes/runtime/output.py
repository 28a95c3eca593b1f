"""Output paths: nodes write below their `output_dir` only."""

from pathlib import Path

from active_recon.errors import ConfigError


def output_path(output_dir: Path, name: str) -> Path:
    """
    Return the absolute path of a file or folder of that relative name under `output_dir`.

    Raises ConfigError where the path would leave it: absolute, with '..', or by a link.
    """
    parts = Path(name).parts
    root = output_dir.absolute()
    path = root / name
    if (not parts or Path(name).is_absolute() or '..' in parts or '\0' in name
            or not path.resolve().is_relative_to(root.resolve())):
        raise ConfigError('invalid output name: expected a relative name that stays under '
                          f'{root}, got {name!r}', 'output')
    return path
