"""
The parameters of a running node.

`Parameters` declares the fields of a dataclass to ROS, rejects values that are out of range, and
applies changes while the node runs.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
import sys
from typing import Generic, TypeVar

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.nodes.runtime.run import one_line, params_files
from active_recon.parameters.declaration import Declared, declared, nearest, NEW_START
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

Values = TypeVar('Values')
Commit = Callable[[], None]


def descriptor(of: Declared) -> ParameterDescriptor:
    """Return the ROS descriptor of a parameter."""
    descriptor = ParameterDescriptor(
        # ROS reads `speed:=2` as an integer, where its user means 2.0.
        description=of.description, read_only=not of.dynamic, dynamic_typing=True,
        additional_constraints=f'expected {of.expected}'
        + ('' if of.dynamic else f'; {NEW_START}'))
    # A range in ROS excludes NaN; where NaN is allowed, the range is in the text only.
    if of.low is not None and of.high is not None and not (of.may_be_nan or of.of):
        if of.kind is int:
            descriptor.integer_range = [
                IntegerRange(from_value=int(of.low), to_value=int(of.high))]
        else:
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(of.low), to_value=float(of.high))]
    return descriptor


class Parameters(Generic[Values]):
    """
    The parameters of one running node; `values` holds their current values.

    Raises ConfigError on a value that is not allowed. A parameter that the node does not have is
    a warning in its log, with the most similar name that it has.
    """

    def __init__(self, node: Node, kind: type[Values]) -> None:
        self._declared = {each.name: each for each in declared(kind)}
        self._prepare: Callable[[Values], Commit | None] = lambda _values: None
        self._pending: tuple[Values, Commit | None] | None = None
        values = {}
        for name, each in self._declared.items():
            default = list(each.default) if each.of else each.default
            given = node.declare_parameter(name, default, ParameterDescriptor(dynamic_typing=True))
            values[name] = each.checked(given.value)
            node.set_descriptor(name, descriptor(each))
        self.values = kind(**values)
        _warn_of_undeclared(node, self._declared)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def on_change(self, prepare: Callable[[Values], Commit | None]) -> None:
        """
        Call `prepare` with the new values of a request, before any of them is set.

        It raises ActiveReconError to reject the request; otherwise it returns a function that
        applies the change, called after `values` has changed, or None where nothing is to do.
        """
        self._prepare = prepare

    def _check(self, request: list[Parameter]) -> SetParametersResult:
        try:
            changes = {each.name: self._declared[each.name].checked(each.value)
                       for each in request if each.name in self._declared}
            for each in request:
                if each.name in changes and each.type_ == Parameter.Type.NOT_SET:  # of a list
                    raise ConfigError(f'parameter {each.name}: cannot be deleted: expected a '
                                      'list, an empty one is [], got None')
            values = replace(self.values, **changes)  # type: ignore[type-var]
            commit = self._prepare(values) if changes else None
        except ActiveReconError as error:
            return SetParametersResult(successful=False, reason=one_line(error))
        self._pending = values, commit
        return SetParametersResult(successful=True)

    def _apply(self, _request: list[Parameter]) -> None:
        if self._pending is None:
            return
        self.values, commit = self._pending
        self._pending = None
        if commit is not None:
            commit()


def _warn_of_undeclared(node: Node, known: Iterable[str]) -> None:
    given = getattr(node, '_parameter_overrides', ())  # rclpy has no public access
    unknown = [name for name in given
               if not node.has_parameter(name) and not name.startswith('qos_overrides.')]
    files = params_files(sys.argv) if unknown else []
    if files:  # all nodes' parameters, and all policies with them: only who needs them waits
        from active_recon.parameters.params_file import meant_for_others
        unknown = [name for name in unknown if name not in set().union(
            *map(meant_for_others, files))]
    for name in unknown:
        node.get_logger().warning(f'parameter {name}: this node has none of that name, so it '
                                  f'changes nothing; {nearest(name, known)}')


def set_read_only_parameter(node: Node, name: str, value: str | list[str],
                            description: str) -> None:
    """Publish a value as a read-only parameter; a later call replaces it."""
    if node.has_parameter(name):
        node.describe_parameter(name).read_only = False  # else it cannot be undeclared
        node.undeclare_parameter(name)
    node.declare_parameter(
        name, value, ParameterDescriptor(description=description, read_only=True),
        ignore_override=True)
