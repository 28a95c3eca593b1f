"""The launch files, as far as they can be checked where launch is not installed."""

from pathlib import Path
import re
import runpy
import sys
from types import ModuleType

from active_recon.nodes.runtime.composable import COMPOSABLE
from active_recon.parameters.declaration import declared
from active_recon.parameters.node_parameters import NODE_PARAMETERS
from active_recon.parameters.recorder import TOPICS
import pytest

ROOT = Path(__file__).parents[2]
FILES = ['demo.launch.py', 'reconstruction.launch.py']
NAMES = {  # what the files import, and from where
    'launch': ['LaunchDescription'],
    'launch.actions': ['DeclareLaunchArgument', 'IncludeLaunchDescription'],
    'launch.conditions': ['IfCondition', 'UnlessCondition'],
    'launch.launch_description_sources': ['PythonLaunchDescriptionSource'],
    'launch.substitutions': ['LaunchConfiguration', 'PathJoinSubstitution'],
    'launch_ros': [],
    'launch_ros.actions': ['Node'],
    'launch_ros.parameter_descriptions': ['ParameterValue'],
    'launch_ros.substitutions': ['FindPackageShare'],
}


class Made:
    """Whatever a launch file makes: it remembers how."""

    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs

    def find(self, kind):
        """Yield all that was made of a kind, however deep."""
        yield from found(kind, [self.args, self.kwargs])


def found(kind, value):
    if isinstance(value, Made):
        if type(value).__name__ == kind:
            yield value
        yield from value.find(kind)
    elif isinstance(value, dict):
        yield from found(kind, list(value.items()))
    elif isinstance(value, list | tuple) or hasattr(value, '__next__') or isinstance(
            value, type({}.items())):
        for each in value:
            yield from found(kind, each)


@pytest.fixture
def described(monkeypatch):
    """Return what a launch file describes."""
    for module, names in NAMES.items():
        stub = ModuleType(module)
        for name in names:
            setattr(stub, name, type(name, (Made,), {}))
        monkeypatch.setitem(sys.modules, module, stub)
    return lambda name: runpy.run_path(
        str(ROOT / 'launch' / name))['generate_launch_description']()


def run_by(node):
    """Return the names of the nodes that a process runs."""
    own = node.kwargs['arguments']
    return own[:own.index('--ros-args')] or [node.kwargs['executable']]


def arguments_of(description):
    return {each.args[0]: each.kwargs for each in description.find('DeclareLaunchArgument')}


def joined(substitution):
    """Return the path, from the root of the package, of a file in its share."""
    parts = substitution.args[0]
    assert isinstance(parts[0], Made) and parts[0].args == ('active_recon',)
    return Path(*parts[1:])


@pytest.mark.parametrize('name', FILES)
def test_every_executable_that_is_started_is_installed(described, name):
    nodes = list(described(name).find('Node'))
    installed = re.search(r'NODES = \((.*?)\)', (ROOT / 'setup.py').read_text(), re.DOTALL)[1]
    assert nodes
    for node in nodes:
        assert node.kwargs['package'] == 'active_recon'
        assert f"'{node.kwargs['executable']}'" in installed
        # A name would be that of all the nodes in a composed process
        assert node.kwargs.get('name', 'composed') == node.kwargs['executable']


@pytest.mark.parametrize('name', FILES)
def test_every_argument_that_is_used_is_declared_and_explained(described, name):
    description = described(name)
    arguments = arguments_of(description)
    used = {each.args[0] for each in description.find('LaunchConfiguration')}
    assert used == arguments.keys()
    assert {'namespace', 'params_file', 'use_sim_time', 'autostart', 'log_level'} <= used
    assert all(each['description'] for each in arguments.values())


@pytest.mark.parametrize('name', FILES)
def test_every_file_that_is_named_exists_and_is_installed(described, name):
    paths = [joined(each) for each in described(name).find('PathJoinSubstitution')]
    assert paths
    for path in paths:
        assert (ROOT / path).is_file()
        assert path.parts[0] in ('config', 'launch')  # whose files setup.py installs
    assert re.search(r"for folder in \('launch', 'config', ", (ROOT / 'setup.py').read_text())


@pytest.mark.parametrize('name', FILES)
def test_every_parameter_that_is_set_is_one_of_its_node(described, name):
    for node in described(name).find('Node'):
        for name in run_by(node):
            known = {each.name for each in declared(NODE_PARAMETERS[name])}
            for parameters in node.kwargs['parameters']:
                if isinstance(parameters, dict):
                    assert parameters.keys() <= known | {'use_sim_time'}


@pytest.mark.parametrize('name', FILES)
def test_what_the_parameters_file_says_is_given_last_and_so_holds(described, name):
    for node in described(name).find('Node'):
        *arguments, file = node.kwargs['parameters']
        assert file.args == ('params_file',)
        assert arguments and all(isinstance(each, dict) for each in arguments)


def test_what_shares_a_process_is_what_would_have_processes_apart(described):
    conditions = {}
    for node in described('reconstruction.launch.py').find('Node'):
        condition = node.kwargs['condition']
        assert isinstance(condition, Made)
        of, = (each.args[0] for each in condition.find('LaunchConfiguration'))
        conditions.setdefault((of, type(condition).__name__), []).append(node)
    apart, (together,) = (conditions['single_process', kind]
                          for kind in ('UnlessCondition', 'IfCondition'))
    assert run_by(together) == [name for node in apart for name in run_by(node)]
    assert set(run_by(together)) <= COMPOSABLE.keys()
    for node in apart:
        for given in ('package', 'namespace', 'remappings', 'parameters', 'output'):
            assert node.kwargs[given] is together.kwargs[given]


@pytest.mark.parametrize('name', FILES)
def test_every_topic_that_is_remapped_is_one_of_the_camera(described, name):
    for node in described(name).find('Node'):
        topics = {topic for topic, _ in node.kwargs.get('remappings', [])}
        assert topics <= {'camera/image_raw', 'camera/camera_info', 'camera/pose'} & set(TOPICS)


def test_the_demo_hands_on_only_what_the_reconstruction_knows(described):
    include, = described('demo.launch.py').find('IncludeLaunchDescription')
    handed = dict(include.kwargs['launch_arguments'])
    assert handed.keys() <= arguments_of(described('reconstruction.launch.py')).keys()
    path, = (joined(each) for each in include.find('PathJoinSubstitution'))
    assert path == Path('launch/reconstruction.launch.py')
