"""The parameters of a node, as a bag tells them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import DataError

_KINDS: Mapping[str, type] = {
    'weights': str, 'policy': str, 'threads': int, 'seed': int, 'max_views': int,
    'object_size': float, 'object_yaw': float, 'threshold': float, 'entropy_tolerance': float,
    'goal_tolerance': float, 'motion_weight': float, 'elevation': float, 'distance': float,
    'azimuth_range': list, 'forbidden_sectors': list, 'reachable_azimuths': list,
    'object_frame': str}
_RANGES = {'threads': (1, 256), 'seed': (0, 2**32 - 1), 'max_views': (1, 1000)}  # as the nodes'


def node_parameters(run: RecordedRun, node: str) -> dict[str, Any]:
    """
    Return the parameters of a node, in whatever namespace; empty where the bag has none.

    Raises DataError where one of those that a replay needs is not of its kind.
    """
    found = next((values for name, values in run.parameters.items()
                  if name.rpartition('/')[2] == node), {})
    return {name: _checked(run.path, name, value) for name, value in found.items()}


def _checked(path: Path, name: str, value: Any) -> Any:
    kind = _KINDS.get(name, object)
    if kind is float and type(value) is int:
        return float(value)
    if kind is list and type(value) is list and all(type(one) in (int, float) for one in value):
        return [float(one) for one in value]
    low, high = _RANGES.get(name, (None, None))
    fits = kind is object or type(value) is kind is not list
    if not fits or low is not None and not low <= value <= high:
        expected = 'a list of numbers' if kind is list else kind.__name__
        within = '' if low is None else f' from {low} to {high}'
        raise DataError(f'{path}: its parameter {name} is {value!r}: expected '
                        f'{expected}{within}')
    return value
