"""The parameters of a node, as recorded in a bag and checked by their declarations."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from active_recon.bags.runs.run import RecordedRun
from active_recon.errors import ConfigError, DataError
from active_recon.parameters.declaration import declared
from active_recon.parameters.node_parameters import NODE_PARAMETERS

_NEEDED = frozenset((
    'weights', 'threads', 'precision', 'object_size', 'object_frame', 'object_yaw', 'threshold',
    'goal_tolerance', 'max_pose_gap', 'policy', 'seed', 'max_views', 'entropy_tolerance',
    'target_quality', 'min_gain',
    'azimuth_range', 'forbidden_sectors', 'reachable_azimuths', 'motion_weight', 'motion_cost',
    'azimuth_speed', 'elevation_speed', 'view_time', 'elevation', 'elevation_range',
    'reachable_views', 'distance'))
"""The parameters that reading and replaying a bag depend on; others are not checked."""


def node_parameters(run: RecordedRun, node: str) -> dict[str, Any]:
    """
    Return the parameters of a node in any namespace; empty if the bag has none.

    Raises DataError if one that a replay needs is not as it is declared.
    """
    try:
        return parameters_among(run.parameters, node)
    except DataError as error:
        raise DataError(f'{run.path}: {error}', error.kind) from error


def parameters_among(recorded: Mapping[str, Mapping[str, Any]], node: str) -> dict[str, Any]:
    """Return those of a node in any namespace, by full names; empty if there are none."""
    return checked_parameters(node, next(iter(nodes_called(node, recorded).values()), {}))


def nodes_called(node: str, recorded: Mapping[str, Mapping[str, Any]]
                 ) -> dict[str, Mapping[str, Any]]:
    """Return the parameters, by full names, of the nodes of a name in any namespace."""
    return {name: values for name, values in recorded.items()
            if name.rpartition('/')[2] == node}


def checked_parameters(node: str, recorded: Mapping[str, Any]) -> dict[str, Any]:
    """Return recorded parameters as their declared types; raises DataError."""
    # Any policy is accepted here: it may be one that is registered by a plugin
    known = {each.name: replace(each, choices=()) for each in declared(NODE_PARAMETERS[node])
             if each.name in _NEEDED}
    try:
        return {name: known[name].checked(value) if name in known else value
                for name, value in recorded.items()}
    except ConfigError as error:
        raise DataError(str(error)) from error
