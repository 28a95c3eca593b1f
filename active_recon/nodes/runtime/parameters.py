"""
The parameters of a running node.

`Parameters` declares to ROS what a dataclass of parameters says, refuses what is out of range, and
applies what is changed while the node runs.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Generic, TypeVar

from active_recon.errors import ActiveReconError
from active_recon.nodes.runtime.run import one_line
from active_recon.parameters.declaration import Declared, declared, nearest, NEW_START
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

Settings = TypeVar('Settings')
Commit = Callable[[], None]


def descriptor(of: Declared) -> ParameterDescriptor:
    """Return what ROS is told."""
    descriptor = ParameterDescriptor(
        # `speed:=2` reaches ROS as an integer, which is what its user wrote for 2.0.
        description=of.description, read_only=not of.changeable, dynamic_typing=True,
        additional_constraints=f'expected {of.expected}'
        + ('' if of.changeable else f'; {NEW_START}'))
    # ROS lets no NaN through a range, so what may be NaN has its range in words alone.
    if of.low is not None and of.high is not None and not (of.may_be_nan or of.of):
        if of.kind is int:
            descriptor.integer_range = [
                IntegerRange(from_value=int(of.low), to_value=int(of.high))]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(of.low), to_value=float(of.high))]
    return descriptor


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
            node.set_descriptor(name, descriptor(each))
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
            node.get_logger().warning(f'parameter {name}: this node has none of that name, so it '
                                      f'changes nothing; {nearest(name, known)}')


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
