"""
A Sphinx extension: pages may link to files of the repository outside their folder.

On the repository's web view such a link is a relative path, as in `../docs/soak.md`. Here the
files are copied to `linked/` and the paths follow, so that Markdown files become pages, too.
"""

from pathlib import Path
import shutil

from sphinx.application import Sphinx

FOLDER = 'linked'
FILES = ('active_recon/weights/MODEL_CARD.md', 'config', 'CHANGELOG.rst', 'CONTRIBUTING.md',
         'docs', 'examples', 'security/README.md')
ORPHAN = '---\norphan: true\n---\n'


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_config_value('repository', '', 'env', str)
    app.connect('builder-inited', copy_files)
    app.connect('source-read', follow_paths)
    return {'parallel_read_safe': True}


def copy_files(app: Sphinx) -> None:
    """Copy the files with their times: what has not changed is not built again."""
    for name in FILES:
        source, target = Path(app.config.repository, name), Path(app.srcdir, FOLDER, name)
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, dirs_exist_ok=True,
                            ignore=shutil.ignore_patterns('__pycache__'))
        else:
            shutil.copy2(source, target)


def follow_paths(app: Sphinx, name: str, source: list[str]) -> None:
    """Let the paths in a page lead to the copies, and those in a copy back to the pages."""
    if name.startswith(f'{FOLDER}/') and app.env.doc2path(name).suffix == '.md':
        up = '../' * name.count('/')
        source[0] = ORPHAN + source[0].replace('](doc/', f']({up}')
    elif '/' not in name:
        source[0] = source[0].replace('](../', f']({FOLDER}/').replace('} ../', f'}} {FOLDER}/')
