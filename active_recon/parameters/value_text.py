"""A parameter's value as text: YAML, taken and shown in the same form."""

from active_recon.errors import ConfigError
from active_recon.yaml_text import yaml_value
import yaml

_INTEGERS = range(-2**63, 2**63)
"""What a ROS parameter can hold."""


def value_from_text(text: str, present: object = None) -> object:
    """
    Return the value that a text in YAML states: a truth, a number, a string or a list of these.

    As far as the text allows, it becomes what the `present` value is: `1` a float in place of
    one, and `off` the string in place of another. Raises ConfigError where it is no such value.
    """
    try:
        value = yaml_value(text)
    except ValueError as error:
        raise _not_a_value(text, str(error)) from error
    if isinstance(present, str) and not isinstance(value, str | list | dict):
        return text  # YAML reads off, 1 and nothing at all as no strings
    if isinstance(present, float):
        value = floating(value)
    if isinstance(value, list) and any(isinstance(each, float) for each in (
            *value, *(present if isinstance(present, list) else ()))):
        value = [floating(each) for each in value]
    elements = value if isinstance(value, list) else [value]
    if not all(_is_scalar(each) for each in elements) or len(set(map(type, elements))) > 1:
        raise _not_a_value(text, type(value).__name__)
    return value


def text_from_value(value: object) -> str:
    """Return a value as one line of YAML."""
    line = str(yaml.safe_dump(
        value, default_flow_style=True, width=float('inf'), allow_unicode=True))
    return line.removesuffix('\n').removesuffix('\n...')


def floating(value: object) -> object:
    """Return the float that a value is, or that its text is to Python: 1, 1e-3, nan; else it."""
    if isinstance(value, bool) or not isinstance(value, int | str):
        return value
    try:
        return float(value)
    except (ValueError, OverflowError):
        return value


def _is_scalar(value: object) -> bool:
    return isinstance(value, bool | float | str) or (isinstance(value, int) and value in _INTEGERS)


def _not_a_value(text: str, why: str) -> ConfigError:
    return ConfigError(f"{text}: no parameter's value: expected, in YAML, true or false, a "
                       f'number, a string, or a list of one of these, got {why}')
