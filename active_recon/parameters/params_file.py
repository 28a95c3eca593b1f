"""ROS parameters files of the package's nodes, checked before any node is started."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
import re
from typing import Any

from active_recon.errors import ConfigError
from active_recon.parameters.declaration import Declared, declared, nearest
from active_recon.parameters.node_parameters import NODE_PARAMETERS
from active_recon.parameters.value_text import floating
from active_recon.parameters.yaml_files import read_yaml
import yaml

_OF_ROS = {'start_type_description_service', 'use_sim_time'}
"""Parameters that every ROS node declares."""
_BESIDE = {'turntable_driver'}
"""Nodes of others that a file of `active-recon calibrate` has parameters for."""


def read_params_file(path: Path) -> dict[str, dict[str, Any]]:
    """
    Return the parameters that a file sets for each node that it names, in the file's order.

    A node may be named in a namespace (`/cell/recorder`) or in any (`/**/recorder`). Parameters
    under `/**` are set for every node, except those that only other nodes have. A turntable's
    driver, which a calibration has parameters for, is left out. Raises ConfigError where the file
    is no parameters file, on a node that is not the package's, on an unknown parameter, and on a
    value that is not allowed.
    """
    given: dict[str, dict[str, Any]] = {}
    shared: dict[str, Any] = {}
    for key, entry in _document(path).items():
        name = str(key).rpartition('/')[2]
        values = _mapping(path, str(key), entry)
        if list(values) != ['ros__parameters']:
            raise ConfigError(f'{path}: {key}: wrong keys: expected ros__parameters and nothing '
                              f'else, got {", ".join(map(str, values)) or "nothing"}')
        values = _mapping(path, str(key), values['ros__parameters'])
        if name == '**':
            shared.update(values)
        elif name in NODE_PARAMETERS:
            given.setdefault(name, {}).update(values)
        elif name not in _BESIDE:
            raise ConfigError(
                f'{path}: unknown node: expected one of {", ".join(NODE_PARAMETERS)}, got {key}')
    if not given:
        raise ConfigError(
            f'{path}: no node: expected one or more of {", ".join(NODE_PARAMETERS)}, got none')
    for node, values in given.items():
        _check(path, node, values, shared)
    return {node: {**_own(node, shared), **values} for node, values in given.items()}


def meant_for_others(path: Path) -> set[str]:
    """Return what a file gives to all nodes, by `/**`, that only some of the package's have."""
    return {str(name) for key, entry in _document(path).items() if str(key).endswith('**')
            for name in _mapping(path, str(key), entry).get('ros__parameters') or ()
            if any(name in _names(node) for node in NODE_PARAMETERS)}


def nodes_left_out(path: Path) -> list[str]:
    """Return the nodes of others that a file has parameters for; raises as `read_params_file`."""
    names = (str(key).rpartition('/')[2] for key in _document(path))
    return [name for name in names if name in _BESIDE]


def check_reach(path: Path, namespace: str) -> None:
    """
    Raise ConfigError on a node that in this namespace ('' or '/cell') gets nothing of the file.

    ROS compares keys with full names; there, `*` is any one part and `**` any number of them.
    """
    keys = defaultdict(list)
    for key in map(str, _document(path)):
        keys[key.rpartition('/')[2]].append(f'/{key.removeprefix("/")}')
    for name in keys:
        # All nodes of `/cell/**`, else those of the name in what stands before it
        where = [key if name == '**' else key.rpartition('/')[0] for key in keys[name]]
        if name in {'**', *NODE_PARAMETERS} and not any(_matches(each, namespace)
                                                        for each in where):
            raise ConfigError(
                f'{path}: {", ".join(keys[name])}: not in the namespace {namespace or "/"} of the '
                f'nodes, which would get nothing of it: expected {namespace}/{name}, or '
                f'{"/**" if name == "**" else f"/**/{name}"} for any namespace')


def _matches(pattern: str, namespace: str) -> bool:
    parts = re.escape(pattern).replace(r'/\*\*', r'(/\w+)*').replace(r'/\*', r'/\w+')
    return re.fullmatch(parts, namespace) is not None


def _own(node: str, shared: Mapping[str, Any]) -> dict[str, Any]:
    """Return the shared parameters without those that only other nodes have."""
    own, *others = map(_names, (node, *NODE_PARAMETERS))
    return {name: value for name, value in shared.items()
            if name in own or name not in set().union(*others)}


def _names(node: str) -> set[str]:
    return {each.name for each in declared(NODE_PARAMETERS[node])}


def _as_ros_reads(parameter: Declared, value: object) -> object:
    """
    Return a value with the numbers that YAML's older version takes for text: nan, 1e-3.

    Raises ConfigError on what ROS does not read: nothing, integers among other numbers, and
    numbers in quotes.
    """
    if value is None:
        raise ConfigError(f'parameter {parameter.name}: no value: expected {parameter.expected}, '
                          f'got nothing{"; an empty list is []" if parameter.of else ""}')
    if float not in (parameter.kind, parameter.of):
        return value
    if isinstance(value, list) and len({type(each) is int for each in value}) > 1:
        raise ConfigError(f'parameter {parameter.name}: not of one type: expected all numbers of '
                          f'a list with a point, as 0.0 is, for ROS, got {value!r}')
    given = value if isinstance(value, list) else [value]
    for each in given:
        if isinstance(each, str) and _is_number(each):  # text only by its quotes, for ROS as well
            raise ConfigError(f'parameter {parameter.name}: text: expected {parameter.expected}, '
                              f'without quotes, got {each!r}')
    return list(map(floating, given)) if isinstance(value, list) else floating(value)


def _is_number(text: str) -> bool:
    """Whether YAML reads a text without quotes as a number."""
    tag = yaml.SafeLoader('').resolve(yaml.ScalarNode, text, (True, False))
    return str(tag).endswith((':float', ':int'))


def _document(path: Path) -> Mapping[Any, Any]:
    value = read_yaml(path)
    if not isinstance(value, Mapping):
        raise ConfigError(f'{path}: no parameters file: expected nodes with ros__parameters, got '
                          f'{"nothing" if value is None else repr(value)}')
    return value


def _mapping(path: Path, where: str, value: object) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(f'{path}: {where}: not a mapping: expected names with values, got '
                          f'{value!r}')
    return value


def _check(path: Path, node: str, values: Mapping[str, Any], shared: Mapping[str, Any]) -> None:
    known = {each.name: each for each in declared(NODE_PARAMETERS[node])}
    for name, value in {**shared, **values}.items():
        if name in known:
            try:
                known[name].checked(_as_ros_reads(known[name], value))
            except ConfigError as error:
                raise ConfigError(f'{path}: {node}: {error}') from None
        elif name in values and name not in _OF_ROS:
            raise ConfigError(f'{path}: {node} has no parameter {name}; {nearest(name, known)}')
