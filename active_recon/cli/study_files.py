"""The files of a study: its figures as JSON, and as a page."""

from collections.abc import Mapping
import json
from pathlib import Path
from typing import Any

from active_recon.whole_files import whole_file


def write_study(result: Mapping[str, Any], page: str, out: Path, name: str) -> list[Path]:
    """
    Write figures as NAME.json and their page, Markdown, as NAME.md; return the paths.

    Each is written whole or not at all: what an earlier run wrote stays where the disk is full.
    """
    out.mkdir(parents=True, exist_ok=True)
    written = [out / f'{name}.json', out / f'{name}.md']
    for path, text in zip(written, (json.dumps(result, indent=1) + '\n', page), strict=True):
        with whole_file(path) as unfinished:
            unfinished.write_text(text)
    return written
