"""The option `--box` of commands that are told the object's cube."""

import math

from active_recon.errors import ConfigError


def box_numbers(text: str) -> tuple[float, float, float, float]:
    """Return x, y, z of the cube's centre and its side; raises ConfigError."""
    try:
        numbers = [float(each) for each in text.split(',')]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not all(map(math.isfinite, numbers)):
        raise ConfigError('--box: invalid cube: expected x,y,z,side, four numbers separated by '
                          f'commas, got {text!r}')
    x, y, z, side = numbers
    return x, y, z, side
