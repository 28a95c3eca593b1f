"""
Declares a node's parameters as data: a frozen dataclass, each field made by `parameter`.

The dataclass describes them completely, without a running node and without ROS.
"""

from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
import math
from os.path import expanduser
from typing import Any, get_args, get_origin, get_type_hints

from active_recon.errors import ConfigError

NEW_START = 'a change requires a restart'


def parameter(default: object, description: str, *, low: float | None = None,
              high: float | None = None, choices: Sequence[str] = (),
              dynamic: bool = False, needed: bool = False, path: bool = False) -> Any:
    """
    Return the field of a parameter: bool, int, float, str, or a tuple of floats or strings.

    `low` and `high` are the inclusive ends of its range, given together; for a tuple they hold
    for each element. `choices` are the allowed strings. A default of NaN means 'not given', and
    NaN is then an allowed value. A `dynamic` parameter can change while the node runs. A string
    that is `needed` cannot be empty; in one that is a `path`, a leading ~ is the home folder.
    """
    return field(default=default, metadata={
        'description': description, 'low': low, 'high': high, 'choices': tuple(choices),
        'dynamic': dynamic, 'needed': needed, 'path': path})


@dataclass(frozen=True)
class Declared:
    """The declaration of one parameter, read from its field."""

    name: str
    kind: type
    of: type | None
    default: Any
    description: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    dynamic: bool
    needed: bool
    path: bool

    @property
    def expected(self) -> str:
        """A description of the allowed values."""
        kind = self.of or self.kind
        if self.choices:
            one = f'one of {", ".join(self.choices)}'
        elif kind in (bool, str):
            one = ('true or false' if kind is bool else
                   'a string that is not empty' if self.needed else 'a string')
        else:
            between = ('' if self.low is None or self.high is None else
                       f' from {number_words(self.low)} to {number_words(self.high)}')
            absent = ', or nan' if self.may_be_nan else ''
            one = f'{"an integer" if kind is int else "a number"}{between}{absent}'
        return f'a list, each {one}' if self.of else one

    @property
    def default_words(self) -> list[str]:
        """The default in words: one, or one for each element of a list."""
        return [_words(each) for each in (self.default if self.of else (self.default,))]

    def checked(self, value: Any) -> Any:
        """Return the value as its kind; ConfigError where it is not allowed."""
        if self.of is not None and (value is None or isinstance(value, Sequence)):
            # An empty list has no type in ROS
            elements = tuple(_as(self.of, element) for element in value or ())
            if not isinstance(value, str) and all(map(self._allows, elements)):
                return elements
        elif self.of is None and self._allows(_as(self.kind, value)):
            # No shell expands what is in a parameters file, or behind `:=`
            return expanduser(value) if self.path else _as(self.kind, value)
        given = list(value) if isinstance(value, array) else value
        raise ConfigError(
            f'parameter {self.name}: invalid value: expected {self.expected}, got {given!r}')

    @property
    def may_be_nan(self) -> bool:
        """Whether NaN is allowed and means 'not given'."""
        return isinstance(self.default, float) and math.isnan(self.default)

    def _allows(self, value: object) -> bool:
        if type(value) is not (self.of or self.kind):
            return False
        if isinstance(value, str):
            return value in self.choices if self.choices else bool(value) or not self.needed
        if isinstance(value, float) and math.isnan(value):
            return self.may_be_nan
        if isinstance(value, int | float) and self.low is not None and self.high is not None:
            return self.low <= value <= self.high
        return not isinstance(value, float) or math.isfinite(value)


def number_words(number: float) -> str:
    """Format a number for messages and tables."""
    return str(int(number)) if number == number // 1 else f'{number:.4g}'


def _words(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return number_words(value) if isinstance(value, float) else str(value)


def _as(kind: type, value: object) -> object:
    """Return an integer as a float where a float is expected, anything else unchanged."""
    return float(value) if kind is float and type(value) is int else value


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint at what may have been meant by a name that is not known."""
    near = get_close_matches(name, known, 1)
    return f'did you mean {near[0]}?' if near else f'there are {", ".join(known)}'


def declared(parameters: type) -> Iterator[Declared]:
    """Yield the declarations of a dataclass of parameters, in their order."""
    kinds = get_type_hints(parameters)
    for each in fields(parameters):
        kind = kinds[each.name]
        of = get_args(kind)[0] if get_origin(kind) is tuple else None
        yield Declared(each.name, kind, of, each.default, **each.metadata)
