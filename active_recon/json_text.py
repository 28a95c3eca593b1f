"""JSON text of others: a value, or one kind of error."""

import json
from typing import Any


def json_value(text: bytes | str) -> Any:
    """Return the value of a JSON text; ValueError where it has none, or is nested too deep."""
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError('nested too deep: expected fewer than a thousand levels') from None
