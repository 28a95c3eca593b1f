"""Studies by commands of the package, run on the data in a folder, and tables of their results."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
import re
import shlex
import shutil
import subprocess
import sys


def with_tables_between_marks(text: str,
                              tables: Mapping[str, Callable[[], Iterator[str]]]) -> str:
    """
    Return a document with the lines of each table between its marks.

    These are the comments `NAME: begin` and `NAME: end`, on lines of their own.
    """
    marks = rf'(<!-- ({"|".join(tables)}): begin -->\n).*?( *<!-- \2: end -->)'
    return re.sub(
        marks, lambda found: found[1] + ''.join(f'{line}\n' for line in tables[found[2]]())
        + found[3], text, flags=re.DOTALL)


def chosen_studies(studies: Mapping[str, str]) -> tuple[Path, list[str]]:
    """
    Return the folder of the data and the names of studies that the command line gives.

    Without names all studies are to be run; without a folder none, and the folder is this one. An
    unknown name and a folder that is not there end the program.
    """
    parser = argparse.ArgumentParser(
        description='Run studies, and write the tables of the documents.')
    parser.add_argument('folder', type=Path, nargs='?',
                        help='of the data; without it only the tables are written')
    parser.add_argument('study', nargs='*', help=f'out of {", ".join(studies)}; default: all')
    asked = parser.parse_args()
    if unknown := sorted(set(asked.study) - set(studies)):
        sys.exit(f'unknown study: expected some of {", ".join(studies)}, got {", ".join(unknown)}')
    if asked.folder is None:
        return Path(), []
    if not asked.folder.is_dir():
        sys.exit(f'{asked.folder}: no such folder: expected that of the data, then names of '
                 'studies')
    return asked.folder, asked.study or list(studies)


def run_study(command: str, arguments: str, stem: str, folder: Path, kept: Path) -> Path:
    """
    Run `active-recon COMMAND ARGUMENTS` in a folder; return the folder of what it wrote.

    `kept` is where STEM.json and STEM.md of that go, and the name of the study: without a suffix.
    """
    out = folder / 'build' / kept.name
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([sys.executable, '-m', 'active_recon.cli.main', command,
                    *shlex.split(arguments), '--out', f'build/{kept.name}'], cwd=folder,
                   check=True)
    for suffix in ('.json', '.md'):
        shutil.copy(out / f'{stem}{suffix}', kept.with_name(f'{kept.name}{suffix}'))
    return out
