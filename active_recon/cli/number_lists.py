"""Numbers separated by commas in options, such as the cube of `--box`."""

import math

from active_recon.errors import ConfigError


def listed_numbers(text: str) -> list[float]:
    """Return the numbers in a text; none where one of them is no finite number."""
    try:
        numbers = [float(each) for each in text.split(',')]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []


def box_numbers(text: str) -> tuple[float, float, float, float]:
    """Return x, y, z of the cube's centre and its side; raises ConfigError."""
    numbers = listed_numbers(text)
    if len(numbers) != 4:
        raise ConfigError('--box: invalid cube: expected x,y,z,side, four numbers separated by '
                          f'commas, got {text!r}')
    x, y, z, side = numbers
    return x, y, z, side
