"""What the package says of itself: one version, and as dependencies what its code imports."""

import ast
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
import re
import sys
from xml.etree import ElementTree

import active_recon
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
import pytest

ROOT = Path(__file__).parents[1]
SETUP = ast.parse((ROOT / 'setup.py').read_text())
MANIFEST = ElementTree.parse(ROOT / 'package.xml').getroot()
ROS_WHEELS = {
    'ros-jazzy-rclpy', 'ros-jazzy-rmw-fastrtps-cpp', 'ros-jazzy-common-interfaces'}
IMPORTED_BY_TORCH = {'tensorboard'}
ROSDEP = {'opencv-python-headless': 'opencv', 'pillow': 'pil', 'pyyaml': 'yaml',
          'scikit-image': 'skimage'}
distributions = cache(packages_distributions)  # takes seconds


def requirements() -> dict[str, Requirement]:
    """Return by name what setup.py asks for, extras too: its strings that have a version range."""
    return in_strings(SETUP)


def extras() -> dict[str, Requirement]:
    return in_strings(setup_argument('extras_require'))


def in_strings(tree: ast.AST) -> dict[str, Requirement]:
    texts = (node.value for node in ast.walk(tree)
             if isinstance(node, ast.Constant) and isinstance(node.value, str))
    found = map(Requirement, filter(re.compile(r'[\w-]+(\[\w+\])?>=\d[\w.,<]*').fullmatch, texts))
    return {canonicalize_name(requirement.name): requirement for requirement in found}


def pins(name: str) -> dict[str, str]:
    lines = (ROOT / name).read_text().splitlines()
    found = (line.split('==') for line in lines if '==' in line)
    return {canonicalize_name(name): version for name, version in found}


def setup_argument(name: str) -> ast.expr:
    return next(node.value for node in ast.walk(SETUP)
                if isinstance(node, ast.keyword) and node.arg == name)


@cache
def imported() -> set[str]:
    """Return the top-level names that the package imports, without the standard library's."""
    trees = [ast.parse(path.read_text()) for package in ('active_recon', 'msg_tools')
             for path in (ROOT / package).rglob('*.py')]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
    return ({name.partition('.')[0] for name in names}
            - {'active_recon', 'msg_tools', *sys.stdlib_module_names})


def test_version_is_the_same_everywhere():
    assert ast.literal_eval(setup_argument('version')) == active_recon.__version__
    assert MANIFEST.findtext('version') == active_recon.__version__


def test_what_is_imported_is_declared():
    declared = requirements().keys()
    from_pip = {name for name, owners in distributions().items()
                if any(canonicalize_name(owner) in declared for owner in owners)}
    from_ros = {element.text for element in MANIFEST.iter('exec_depend')}
    same_name = {name for name in imported() if canonicalize_name(name) in declared}
    assert imported() <= from_pip | same_name | from_ros  # nncf need not be installed here


def test_what_is_declared_is_imported():
    used = {canonicalize_name(owner) for name in imported()
            for owner in distributions().get(name, ())}
    assert requirements().keys() - extras().keys() - ROS_WHEELS - IMPORTED_BY_TORCH <= used


def test_what_setup_asks_for_is_in_the_manifest_or_said_to_be_in_setup_alone():
    by_rosdep = {element.text.removeprefix('python3-').removesuffix('-pip')
                 for element in MANIFEST.iter('exec_depend')}
    comment = re.search('<!-- (.*) are named by', (ROOT / 'package.xml').read_text())
    alone = set(re.split(', | and ', comment[1]))
    needed = {ROSDEP.get(name, name) for name in
              requirements().keys() - extras().keys() - ROS_WHEELS}
    assert needed - by_rosdep == alone


@pytest.mark.parametrize('name', sorted(requirements().keys() - {'torch'}))
def test_tested_version_is_within_the_declared_range(name):
    assert pins('constraints.txt')[name] in requirements()[name].specifier


def test_the_versions_for_jazzy_are_within_the_declared_ranges():
    found = pins('constraints-jazzy.txt')
    assert found['numpy'].startswith('1.26.')
    assert all(version in requirements()[name].specifier for name, version in found.items())


def test_the_lowest_versions_are_the_first_of_the_declared_ranges():
    found = pins('constraints-lowest.txt')
    for name in found.keys() & requirements().keys():
        lowest = next(each.version for each in requirements()[name].specifier
                      if each.operator == '>=')
        assert found[name] in requirements()[name].specifier
        assert f'{found[name]}.'.startswith(f'{lowest}.')
    assert found.keys() >= (requirements().keys() - extras().keys() - ROS_WHEELS - {'torch'})


def test_torch_that_make_installs_is_within_the_declared_range():
    chosen = re.search(r'^TORCH \?= torch==(.*)$', (ROOT / 'Makefile').read_text(), re.MULTILINE)
    assert chosen[1] in requirements()['torch'].specifier


def test_colcon_has_a_setuptools_that_it_works_with():
    assert int(pins('constraints-colcon.txt')['setuptools'].partition('.')[0]) < 80


def test_every_ray_that_is_allowed_has_the_token_that_its_scripts_make():
    script = (ROOT / 'examples' / 'cluster' / 'slurm.sh').read_text()
    assert 'ray get-auth-token' in script
    assert not requirements()['ray'].specifier.contains('2.51.9')  # Ray has it since 2.52
