"""Compiled graphs in the user's cache, each checked by its hash before it is taken."""

import hashlib
import os
from pathlib import Path

from active_recon.whole_files import whole_file

VARIABLE = 'ACTIVE_RECON_CACHE'
"""Names another folder for what may be made anew at any time; empty for none."""
_DIGEST = hashlib.sha256().digest_size


def cache_folder() -> Path | None:
    """Return the folder of what may be made anew, which need not exist; None for none."""
    chosen = os.environ.get(VARIABLE)
    if chosen == '':
        return None
    usual = Path(os.environ.get('XDG_CACHE_HOME') or '~/.cache') / 'active_recon'
    try:  # no shell reads what a launch file or systemd sets
        return Path(chosen or usual).expanduser()
    except RuntimeError:  # a user without a home, as in a container
        return None


def compiled_path(exported: bytes, name: str, *made_by: str) -> Path | None:
    """
    Return where what was compiled of an exported file is kept; None where nothing is kept.

    `made_by`: all else that it depends on, such as the library's version and the processor.
    """
    folder = cache_folder()
    key = hashlib.sha256('\0'.join((hashlib.sha256(exported).hexdigest(), *made_by)).encode())
    return folder and folder / 'compiled' / f'{name}-{key.hexdigest()[:24]}.bin'


def read_compiled(path: Path | None) -> memoryview | None:
    """Return what `write_compiled` wrote, None where there is nothing, or nothing whole."""
    if path is None:
        return None
    try:
        data = memoryview(path.read_bytes())
    except OSError:
        return None
    compiled = data[_DIGEST:]
    return compiled if hashlib.sha256(compiled).digest() == data[:_DIGEST] else None


def write_compiled(path: Path | None, compiled: bytes) -> str:
    """Write what was compiled, at once as a whole; return why it could not be, '' else."""
    if path is None:
        return ''
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as unfinished:
            unfinished.write_bytes(hashlib.sha256(compiled).digest() + compiled)
    except OSError as error:
        return (f'{path.parent}: compiled networks cannot be kept there: {error.strerror}; each '
                f'start takes a second more: set {VARIABLE} to another folder, or to none')
    return ''
