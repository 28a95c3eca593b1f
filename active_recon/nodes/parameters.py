"""
A node's parameters, declared as data: a frozen dataclass, each field made by `parameter`.

The dataclass says all that is to be known of them, without a running node; `Parameters` declares
them to ROS, refuses what is out of range, and applies what is changed while the node runs.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
import math
from typing import Any, Generic, get_args, get_origin, get_type_hints, TypeVar

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.nodes.run import one_line
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

NEW_START = 'a change needs a new start'
Settings = TypeVar('Settings')
Commit = Callable[[], None]


def parameter(default: object, description: str, *, low: float | None = None,
              high: float | None = None, choices: Sequence[str] = (),
              changeable: bool = False) -> Any:
    """
    Return the field of a parameter: bool, int, float, str, or a tuple of floats or strings.

    `low` and `high` are the ends of its range, both inside it and given together; of a tuple they
    are those of its elements. `choices` are the words that a string may be. A default of NaN
    stands for 'not given' and may be passed as such. One that is `changeable` may change while
    the node runs.
    """
    return field(default=default, metadata={
        'description': description, 'low': low, 'high': high, 'choices': tuple(choices),
        'changeable': changeable})


@dataclass(frozen=True)
class Declared:
    """What is declared of one parameter: its field, read."""

    name: str
    kind: type
    of: type | None
    default: Any
    description: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    changeable: bool

    @property
    def expected(self) -> str:
        """What a value has to be, in words."""
        kind = self.of or self.kind
        if self.choices:
            one = f'one of {", ".join(self.choices)}'
        elif kind in (bool, str):
            one = 'a string' if kind is str else 'true or false'
        else:
            between = ('' if self.low is None or self.high is None else
                       f' from {number_words(self.low)} to {number_words(self.high)}')
            absent = ', or nan' if self._may_be_nan else ''
            one = f'{"an integer" if kind is int else "a number"}{between}{absent}'
        return f'a list, each {one}' if self.of else one

    def checked(self, value: Any) -> Any:
        """Return the value as its kind; ConfigError where it is another or out of range."""
        if self.of is not None and (value is None or isinstance(value, Sequence)):
            # An empty list has no type in ROS
            elements = tuple(_as(self.of, element) for element in value or ())
            if not isinstance(value, str) and all(map(self._allows, elements)):
                return elements
        elif self.of is None and self._allows(_as(self.kind, value)):
            return _as(self.kind, value)
        raise ConfigError(f'parameter {self.name}: expected {self.expected}, got {value!r}')

    def descriptor(self) -> ParameterDescriptor:
        """Return what ROS is told."""
        descriptor = ParameterDescriptor(
            # `speed:=2` reaches ROS as an integer, which is what its user wrote for 2.0.
            description=self.description, read_only=not self.changeable, dynamic_typing=True,
            additional_constraints=f'expected {self.expected}'
            + ('' if self.changeable else f'; {NEW_START}'))
        # ROS lets no NaN through a range, so what may be NaN has its range in words alone.
        if self.low is not None and self.high is not None and not (self._may_be_nan or self.of):
            if self.kind is int:
                descriptor.integer_range = [
                    IntegerRange(from_value=int(self.low), to_value=int(self.high))]
            else:
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=float(self.low), to_value=float(self.high))]
        return descriptor

    @property
    def _may_be_nan(self) -> bool:
        return isinstance(self.default, float) and math.isnan(self.default)

    def _allows(self, value: object) -> bool:
        if type(value) is not (self.of or self.kind):
            return False
        if isinstance(value, str):
            return not self.choices or value in self.choices
        if isinstance(value, float) and math.isnan(value):
            return self._may_be_nan
        if isinstance(value, int | float) and self.low is not None and self.high is not None:
            return self.low <= value <= self.high
        return not isinstance(value, float) or math.isfinite(value)


def number_words(number: float) -> str:
    """Return a number as it is told to people."""
    return str(int(number)) if number == number // 1 else f'{number:.4g}'


def _as(kind: type, value: object) -> object:
    """Return an integer as a float where a float is wanted, all else as it is."""
    return float(value) if kind is float and type(value) is int else value


def declared(settings: type) -> Iterator[Declared]:
    """Yield the parameters of a dataclass of settings, in their order."""
    kinds = get_type_hints(settings)
    for each in fields(settings):
        kind = kinds[each.name]
        of = get_args(kind)[0] if get_origin(kind) is tuple else None
        yield Declared(each.name, kind, of, each.default, **each.metadata)


class Parameters(Generic[Settings]):
    """
    The parameters of one running node; `now` holds their values.

    Raises ConfigError, which names the parameter, what was expected and what came. What a node is
    given and does not have is a warning in its log, with the nearest name that it has.
    """

    def __init__(self, node: Node, settings: type[Settings]) -> None:
        self._declared = {each.name: each for each in declared(settings)}
        self._prepare: Callable[[Settings], Commit | None] = lambda _settings: None
        self._waiting: tuple[Settings, Commit | None] | None = None
        values = {}
        for name, each in self._declared.items():
            default = list(each.default) if each.of else each.default
            given = node.declare_parameter(name, default, ParameterDescriptor(dynamic_typing=True))
            values[name] = each.checked(given.value)
            node.set_descriptor(name, each.descriptor())
        self.now = settings(**values)
        _warn_of_undeclared(node, self._declared)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def on_change(self, prepare: Callable[[Settings], Commit | None]) -> None:
        """
        Let `prepare` see all changes of a request together, before any is made.

        It is called with the new settings and raises ActiveReconError to refuse them; otherwise it
        returns what puts them into effect, or None where there is nothing to do. That is called
        when `now` has changed.
        """
        self._prepare = prepare

    def _check(self, request: list[Parameter]) -> SetParametersResult:
        try:
            changes = {each.name: self._declared[each.name].checked(each.value)
                       for each in request if each.name in self._declared}
            settings = replace(self.now, **changes)  # type: ignore[type-var]
            commit = self._prepare(settings) if changes else None
        except ActiveReconError as error:
            return SetParametersResult(successful=False, reason=one_line(error))
        self._waiting = settings, commit
        return SetParametersResult(successful=True)

    def _apply(self, _request: list[Parameter]) -> None:
        if self._waiting is None:
            return
        self.now, commit = self._waiting
        self._waiting = None
        if commit is not None:
            commit()


def _warn_of_undeclared(node: Node, known: Iterable[str]) -> None:
    for name in getattr(node, '_parameter_overrides', ()):  # rclpy tells it nowhere else
        if not node.has_parameter(name) and not name.startswith('qos_overrides.'):
            near = get_close_matches(name, known, 1)
            hint = f'did you mean {near[0]}?' if near else f'there are {", ".join(known)}'
            node.get_logger().warning(f'parameter {name}: this node has none of that name, so it '
                                      f'changes nothing; {hint}')


class ReadOnlySaysWhy:
    """A node of which a read-only parameter, when it is set, says what to do instead."""

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all parameters or none; see rclpy's Node."""
        node: Any = super()
        result: SetParametersResult = node.set_parameters_atomically(parameter_list)
        if not result.successful and 'read-only' in result.reason:
            result.reason = f'{result.reason.rstrip(".")}; {NEW_START}'
        return result


def tell(node: Node, name: str, value: str | list[str], description: str) -> None:
    """Tell a fact about the node as a parameter that nobody can set; told anew, it is replaced."""
    if node.has_parameter(name):
        node.describe_parameter(name).read_only = False  # else ROS forgets it no more
        node.undeclare_parameter(name)
    node.declare_parameter(
        name, value, ParameterDescriptor(description=description, read_only=True),
        ignore_override=True)
