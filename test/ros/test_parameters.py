"""Parameters declared as data: what a value may be, and what ROS is told of it."""

from array import array
from dataclasses import make_dataclass
import math
from types import SimpleNamespace

from active_recon.errors import ConfigError
from active_recon.nodes.runtime.parameters import Parameters, set_read_only_parameter
from active_recon.parameters.declaration import declared, NEW_START, parameter
from active_recon.parameters.node_parameters import NODE_PARAMETERS
import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

pytestmark = pytest.mark.ros


class GivenNode(Node):
    """A node that is given values for its parameters at start."""

    def __init__(self, **given):
        super().__init__('given', parameter_overrides=[
            Parameter(name, value=value) for name, value in given.items()])


@pytest.fixture
def make_node(ros):
    nodes = []

    def make(**given):
        nodes.append(GivenNode(**given))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()


def parameters_of(**declared):
    """Return a dataclass of parameters, from pairs of a type and a parameter."""
    return make_dataclass(
        'Declared', [(name, *each) for name, each in declared.items()], frozen=True)


NUMBER = float, parameter(1.0, 'a number', low=0.0, high=2.0)
COUNT = int, parameter(1, 'a count', low=0, high=2)
NOT_GIVEN = float, parameter(math.nan, 'a number, if any', low=0.0, high=2.0)
WORD = str, parameter('a', 'a word', choices=('a', 'b'))
FRAME = str, parameter('a', 'a frame', needed=True)
FLAG = bool, parameter(True, 'a flag')
NUMBERS = tuple[float, ...], parameter((), 'numbers', low=-1.0, high=1.0)
WORDS = tuple[str, ...], parameter(('a',), 'words')


@pytest.mark.parametrize(('given', 'declared', 'said'), [
    ('fast', NUMBER, "a number from 0 to 2, got 'fast'"),
    (3, NUMBER, 'a number from 0 to 2, got 3'),
    (math.nan, NUMBER, 'a number from 0 to 2, got nan'),
    (math.inf, NOT_GIVEN, 'a number from 0 to 2, or nan, got inf'),
    (1.5, COUNT, 'an integer from 0 to 2, got 1.5'),
    (True, COUNT, 'an integer from 0 to 2, got True'),
    ('c', WORD, "one of a, b, got 'c'"),
    ('', FRAME, "a string that is not empty, got ''"),
    (1, FLAG, 'true or false, got 1'),
    ([0.5, 2.0], NUMBERS, r'a list, each a number from -1 to 1, got \[0.5, 2.0\]'),
    (array('d', [0.5, 2.0]), NUMBERS, r'a list, each a number from -1 to 1, got \[0.5, 2.0\]'),
    ('abc', WORDS, "a list, each a string, got 'abc'"),
    ([1, 2], WORDS, r'a list, each a string, got \[1, 2\]')])
def test_a_value_of_another_kind_or_out_of_range_is_refused(make_node, given, declared, said):
    with pytest.raises(ConfigError, match=f'parameter it: invalid value: expected {said}'):
        Parameters(make_node(it=given), parameters_of(it=declared))


@pytest.mark.parametrize(('given', 'declared', 'value'), [
    (2, NUMBER, 2.0), (0.0, NUMBER, 0.0), (0, COUNT, 0), ('b', WORD, 'b'), (False, FLAG, False),
    ([0, 1], NUMBERS, (0.0, 1.0)), ([], NUMBERS, ()), (['x', 'y'], WORDS, ('x', 'y')),
    ([], WORDS, ())])
def test_the_ends_of_a_range_are_inside_and_an_integer_may_stand_for_a_number(
        make_node, given, declared, value):
    values = Parameters(make_node(it=given), parameters_of(it=declared)).values
    assert values.it == value
    assert type(values.it) is type(value)


def test_a_number_that_is_not_given_is_nan(make_node):
    assert math.isnan(Parameters(make_node(), parameters_of(it=NOT_GIVEN)).values.it)
    assert math.isnan(Parameters(make_node(it=math.nan), parameters_of(it=NOT_GIVEN)).values.it)


@pytest.mark.parametrize(('given', 'value'), [
    ('~/bags', '/home/me/bags'), ('', ''), ('bags/~', 'bags/~'), ('/bags', '/bags')])
def test_a_leading_tilde_of_a_path_is_the_home_folder_and_ros_is_told_what_was_given(
        make_node, monkeypatch, given, value):
    monkeypatch.setenv('HOME', '/home/me')
    node = make_node(it=given)
    parameters = Parameters(node, parameters_of(
        it=(str, parameter('', 'a folder', dynamic=True, path=True))))
    assert parameters.values.it == value
    assert node.get_parameter('it').value == given
    node.set_parameters([Parameter('it', value='~')])
    assert parameters.values.it == '/home/me'


@pytest.mark.parametrize(('node', 'names'), [
    ('reconstructor', ('weights', 'segmenter', 'output_dir', 'state_file')),
    ('view_planner', ('weights',)), ('turntable_camera', ('mesh', 'dataset')),
    ('camera', ('source', 'camera_info')), ('recorder', ('output_dir',)), ('player', ('bag',)),
    ('viewer', ())])
def test_files_and_folders_of_every_node_may_be_below_the_home_folder(node, names):
    assert tuple(each.name for each in declared(NODE_PARAMETERS[node]) if each.path) == names


def test_ros_is_told_the_range_the_choices_and_what_needs_a_new_start(make_node):
    node = make_node()
    changing = int, parameter(3, 'changes', low=1, high=5, dynamic=True)
    Parameters(node, parameters_of(number=NUMBER, word=WORD, changing=changing))
    number, word, count = node.describe_parameters(['number', 'word', 'changing'])
    assert (number.floating_point_range[0].from_value,
            number.floating_point_range[0].to_value) == (0.0, 2.0)
    assert (count.integer_range[0].from_value, count.integer_range[0].to_value) == (1, 5)
    assert number.read_only and not count.read_only
    assert number.description == 'a number'
    assert word.additional_constraints == f'expected one of a, b; {NEW_START}'


def dynamic(node):
    """Declare two parameters that may change; return them and what was put into effect."""
    applied = []

    def prepare(values):
        if values.low > values.high:
            raise ConfigError('expected low below high')
        return lambda: applied.append((values.low, values.high))

    parameters = Parameters(node, parameters_of(
        low=(int, parameter(1, 'the low end', low=0, high=9, dynamic=True)),
        high=(int, parameter(2, 'the high end', low=0, high=9, dynamic=True)),
        fixed=(int, parameter(0, 'fixed'))))
    parameters.on_change(prepare)
    return parameters, applied


def test_changes_that_come_together_are_checked_together_and_applied_as_one(make_node):
    node = make_node()
    parameters, applied = dynamic(node)
    assert not node.set_parameters_atomically([Parameter('low', value=5)]).successful
    assert node.set_parameters_atomically(
        [Parameter('low', value=5), Parameter('high', value=6)]).successful
    assert applied == [(5, 6)]
    assert (parameters.values.low, parameters.values.high) == (5, 6)


@pytest.mark.parametrize(('changes', 'said'), [
    ({'low': 9}, 'expected low below high'),
    ({'low': 'x'}, "parameter low: invalid value: expected an integer from 0 to 9, got 'x'"),
    ({'low': None}, 'parameter low: invalid value: expected an integer from 0 to 9, got None'),
    ({'high': 10}, 'out of range'),
    ({'low': 2, 'fixed': 1}, 'read-only')])
def test_a_change_that_is_refused_says_why_and_changes_nothing(make_node, changes, said):
    node = make_node()
    parameters, applied = dynamic(node)
    before = parameters.values
    result = node.set_parameters_atomically(
        [Parameter(name, value=value) for name, value in changes.items()])
    assert not result.successful
    assert said in result.reason
    assert not applied
    assert parameters.values == before
    assert [each.value for each in node.get_parameters(['low', 'high', 'fixed'])] == [1, 2, 0]


def test_a_list_can_be_emptied_and_not_deleted(make_node):
    node = make_node(it=[0.5])
    parameters = Parameters(node, parameters_of(it=(
        tuple[float, ...], parameter((), 'numbers', low=-1.0, high=1.0, dynamic=True))))
    deleted, = node.set_parameters([Parameter('it')])
    assert not deleted.successful
    assert 'it: cannot be deleted: expected a list, an empty one is []' in deleted.reason
    assert list(node.get_parameter('it').value) == [0.5]
    assert parameters.values.it == (0.5,)
    assert node.set_parameters_atomically(
        [Parameter('it', Parameter.Type.DOUBLE_ARRAY, [])]).successful
    assert parameters.values.it == ()


def test_a_read_only_parameter_is_replaced_by_its_node_alone(make_node):
    node = make_node(fact='mine')
    set_read_only_parameter(node, 'fact', 'first', 'a fact')
    set_read_only_parameter(node, 'fact', 'second', 'a fact')
    assert not node.set_parameters_atomically([Parameter('fact', value='mine')]).successful
    assert node.get_parameter('fact').value == 'second'


def test_a_parameter_that_a_node_does_not_have_is_a_warning_with_the_nearest_name(
        make_node, monkeypatch):
    node = make_node(object_siez=0.3, seed=7, rate=2.0, use_sim_time=False)
    said = []
    monkeypatch.setattr(node, 'get_logger', lambda: SimpleNamespace(warning=said.append))
    now = Parameters(node, parameters_of(
        object_size=(float, parameter(1.0, 'm')), rate=(float, parameter(1.0, 'Hz')))).values
    assert (now.object_size, now.rate) == (1.0, 2.0)
    assert said == [
        'parameter object_siez: this node has none of that name, so it changes nothing; '
        'did you mean object_size?',
        'parameter seed: this node has none of that name, so it changes nothing; '
        'there are object_size, rate']


def test_what_a_file_gives_to_all_nodes_for_some_of_them_is_no_warning_of_the_others(
        make_node, monkeypatch, tmp_path):
    path = tmp_path / 'all.yaml'
    path.write_text('/**: {ros__parameters: {object_size: 2.0, colour: red}}\n'
                    '/**/a_node: {ros__parameters: {mesh: chair}}\n')
    monkeypatch.setattr('sys.argv', ['a_node', '--ros-args', '--params-file', str(path)])
    node = make_node(object_size=2.0, colour='red', mesh='chair')
    said = []
    monkeypatch.setattr(node, 'get_logger', lambda: SimpleNamespace(warning=said.append))
    Parameters(node, parameters_of(rate=(float, parameter(1.0, 'Hz'))))
    assert [each.partition(':')[0] for each in said] == ['parameter colour', 'parameter mesh']


@pytest.mark.parametrize(('name', 'near'), [
    ('reconstructor', 'object_size'), ('view_planner', 'object_size'), ('recorder', '')])
def test_a_misspelt_parameter_is_said_in_the_log_of_a_node_that_runs(start_node, name, near):
    node = start_node(name, object_siez=0.3)
    line, = node.log('WARN.*parameter object_siez')
    assert f'did you mean {near}?' in line or not near
