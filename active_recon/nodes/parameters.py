"""Parameters with a description and a range, refused at start where they are out of it."""

from collections.abc import Sequence
import math
from typing import TypeVar

from active_recon.errors import ConfigError
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

Value = TypeVar('Value', bool, int, float, str)


def declare(
    node: Node,
    name: str,
    default: Value,
    description: str,
    low: float | None = None,
    high: float | None = None,
    choices: Sequence[str] = (),
) -> Value:
    """
    Declare a parameter that is read once, at start, and return its value.

    `low` and `high` are the ends of its range, both inside it and given together; `choices` are
    the words a string may be. A default of NaN stands for 'not given' and may be passed as such.
    Raises ConfigError that names the parameter, what was expected and what came.
    """
    expected = _expected(default, low, high, choices)
    # `speed:=2` reaches ROS as an integer, which is what its user wrote for 2.0.
    descriptor = ParameterDescriptor(
        description=description, read_only=True, dynamic_typing=True,
        additional_constraints=f'expected {expected}')
    value = node.declare_parameter(name, default, descriptor).value
    if isinstance(default, float) and type(value) is int:
        value = float(value)
    if type(value) is not type(default) or not _within(value, default, low, high, choices):
        raise ConfigError(f'parameter {name}: expected {expected}, got {value!r}')
    return value


def tell(node: Node, name: str, value: str, description: str) -> None:
    """Tell a fact about the node as a parameter that nobody can set."""
    node.declare_parameter(
        name, value, ParameterDescriptor(description=description, read_only=True),
        ignore_override=True)


def _expected(default: object, low: float | None, high: float | None,
              choices: Sequence[str]) -> str:
    if choices:
        return f'one of {", ".join(choices)}'
    if isinstance(default, str | bool):
        return 'a string' if isinstance(default, str) else 'true or false'
    number = 'an integer' if isinstance(default, int) else 'a number'
    between = '' if low is None else f' from {low:g} to {high:g}'
    absent = ', or nan' if isinstance(default, float) and math.isnan(default) else ''
    return f'{number}{between}{absent}'


def _within(value: object, default: object, low: float | None, high: float | None,
            choices: Sequence[str]) -> bool:
    if isinstance(value, str):
        return not choices or value in choices
    if isinstance(value, float) and math.isnan(value):
        return isinstance(default, float) and math.isnan(default)
    if isinstance(value, int | float) and low is not None and high is not None:
        return low <= value <= high
    return not isinstance(value, float) or math.isfinite(value)
