"""
The documentation's Sphinx configuration: `make doc`, or rosdoc2 with rosdoc2.yaml.

Plain values only, which rosdoc2 can take over; it builds from a copy of this folder.
"""

import gc
from itertools import pairwise
import os
from pathlib import Path
import re
import sys

from astroid import MANAGER, nodes
from astroid.brain.brain_dataclasses import dataclass_transform, is_decorated_with_dataclass

gc.disable()  # it takes a fifth of the time, and frees nothing that counts in so short a process
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))  # linked_files
# astroid, which autodoc2 reads the source with, would look up the types of all fields, for nothing
MANAGER.unregister_transform(nodes.ClassDef, dataclass_transform, is_decorated_with_dataclass)


def _repository() -> Path:
    """Return the folder of package.xml: the one above, or the one that rosdoc2 is given."""
    if (HERE.parent / 'package.xml').exists():
        return HERE.parent
    return next(Path(value).resolve() for option, value in pairwise(sys.argv)
                if option in ('-p', '--package-path'))


repository = str(_repository())

project = 'active_recon'
author = 'active_recon developers'
project_copyright = f'{author}. Apache-2.0'
release = version = re.findall(
    r'<version>(.*)</version>', Path(repository, 'package.xml').read_text())[0]

extensions = ['myst_parser', 'autodoc2', 'sphinx_copybutton', 'linked_files']
root_doc = 'index'
exclude_patterns = [  # of rosdoc2
    'index.rst', 'modules.rst', 'active_recon*.rst', '__*', 'doc', 'interfaces/*', 'standard*',
    'user_docs*']
source_suffix = {'.rst': 'restructuredtext', '.md': 'markdown'}

myst_enable_extensions = ['colon_fence', 'deflist']
myst_heading_anchors = 3

# The source is read and not imported: neither ROS nor torch has to be installed. What others build
# upon is shown; the rest is read in the code.
autodoc2_packages = [{
    'path': os.path.relpath(f'{repository}/active_recon', HERE),
    'exclude_dirs': [
        '__pycache__', 'batch', 'capture', 'cli', 'cluster', 'demo', 'evaluation', 'launching',
        'nodes', 'objects', 'paper', 'parameters', 'report', 'shapes', 'simulation', 'storage',
        'training', 'viewer', 'watching', 'weights'],
    'exclude_files': [
        'config.py', 'environment.py', 'file_names.py', 'freed_memory.py', 'interrupts.py',
        'json_text.py', 'png_files.py', 'reporting.py', 'view_colors.py',
        'whole_files.py', 'yaml_text.py'],
}]
autodoc2_output_dir = 'api'
autodoc2_render_plugin = 'myst'
autodoc2_hidden_objects = ['private', 'dunder', 'inherited', 'undoc']
autodoc2_skip_module_regexes = [
    r'active_recon\.(calibration|datasets|models)\.(?!(calibration|layout|network|registry)$).*']
autodoc2_docstring_parser_regexes = [(r'.*', 'myst')]
autodoc2_class_docstring = 'both'

html_theme = 'furo'
html_title = f'{project} {version}'
html_theme_options = {'navigation_with_keys': True}
html_show_sourcelink = False
pygments_style = 'friendly'

rosdoc2_settings = {'override_theme': False, 'enable_autodoc': False, 'enable_intersphinx': False,
                    'automatically_extend_intersphinx_mapping': False, 'support_markdown': False}
