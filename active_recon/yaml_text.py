"""YAML text as ROS reads it: whatever is wrong with it is one error, in one line."""

from typing import Any

import yaml

_FAST = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)  # libyaml takes a tenth of the time
_MOST_NESTED = 100


class _Loader(_FAST):  # type: ignore[misc, valid-type]
    """A date is text."""

    yaml_implicit_resolvers = {
        first: [(tag, rule) for tag, rule in rules if not tag.endswith(':timestamp')]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()}


def yaml_value(text: bytes | str) -> Any:
    """
    Return the value of a YAML text, None of an empty one; raises ValueError where it has none.

    Aliases are refused: a few nested ones expand to gigabytes. So are more than 100 levels, which
    libyaml would compose until the stack is full.
    """
    try:
        _require_plain(text)
        return yaml.load(text, _Loader)
    except (yaml.YAMLError, ValueError) as error:
        raise ValueError(' '.join(str(error).split())) from error
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        # How PyYAML answers a text that does not fit its tag, such as !!int "" or !!bool x
        raise ValueError('a value that does not fit its tag') from error


def _require_plain(text: bytes | str) -> None:
    """Raise ValueError where a text has aliases or is nested too deep."""
    depth = 0
    for event in yaml.parse(text, _Loader):
        if isinstance(event, yaml.AliasEvent):
            raise ValueError('aliases are not allowed')
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > _MOST_NESTED:
            raise ValueError(f'nested too deep: expected at most {_MOST_NESTED} levels')
