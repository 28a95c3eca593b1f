"""The files of a study: its figures as JSON, and as a page."""

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from active_recon.whole_files import whole_file, writable


def require_writable_study(out: Path, name: str) -> None:
    """Raise ConfigError where `write_study` could not write; to be asked before the work."""
    for path in _paths(out, name):
        writable(path)


def write_study(result: Mapping[str, Any], page: str, out: Path, name: str) -> list[Path]:
    """
    Write figures as NAME.json and their page, Markdown, as NAME.md; return the paths.

    Each is written whole or not at all: what an earlier run wrote stays where the disk is full.
    """
    written = _paths(out, name)
    for path, text in zip(written, (json.dumps(result, indent=1) + '\n', page), strict=True):
        with whole_file(path) as unfinished:
            unfinished.write_text(text)
    return written


def _paths(out: Path, name: str) -> list[Path]:
    return [out / f'{name}.json', out / f'{name}.md']
