"""The topics and services a running node uses, and SROS2 policies that allow exactly those."""

from collections.abc import Iterable, Mapping
from pathlib import Path
import xml.etree.ElementTree as ElementTree

from active_recon.errors import DataError
from rclpy.node import Node

Access = dict[tuple[str, str], frozenset[str]]
"""
One node's names by ('topic', 'publish' or 'subscribe') and ('service', 'reply' or 'request').

A name is `~/x` if private, `x` if in the node's namespace, else `/x`.
"""
POLICY_VERSION = '0.2.0'
ENCLAVES = '/active_recon'
_QUERIES = {
    ('topic', 'publish'): Node.get_publisher_names_and_types_by_node,
    ('topic', 'subscribe'): Node.get_subscriber_names_and_types_by_node,
    ('service', 'reply'): Node.get_service_names_and_types_by_node,
    ('service', 'request'): Node.get_client_names_and_types_by_node}


def live_access(observer: Node, name: str, namespace: str) -> Access:
    """
    Return what a node uses now, as far as the observer has discovered it.

    Raises rclpy's NodeNameNonExistentError while the node is not known.
    """
    return {kind: frozenset(_relative(found, name, namespace)
                            for found, _ in query(observer, name, namespace))
            for kind, query in _QUERIES.items()}


def joined(accesses: Iterable[Access]) -> Access:
    """Return the union of several nodes' access."""
    accesses = list(accesses)
    return {kind: frozenset().union(*(each.get(kind, frozenset()) for each in accesses))
            for kind in _QUERIES}


def write_policies(path: Path, nodes: Mapping[str, Access], namespace: str = '/') -> None:
    """Write a policy file with one enclave for each node, by its name, that allows its access."""
    policy = ElementTree.Element('policy', version=POLICY_VERSION)
    enclaves = ElementTree.SubElement(policy, 'enclaves')
    for name in sorted(nodes):
        enclave = ElementTree.SubElement(enclaves, 'enclave', path=f'{ENCLAVES}/{name}')
        profile = ElementTree.SubElement(
            ElementTree.SubElement(enclave, 'profiles'), 'profile', ns=namespace, node=name)
        for (kind, rule), names in nodes[name].items():
            if names:
                allowed = ElementTree.SubElement(profile, f'{kind}s', {rule: 'ALLOW'})
                for each in sorted(names):
                    ElementTree.SubElement(allowed, kind).text = each
    ElementTree.indent(policy)
    path.write_text('<?xml version="1.0" encoding="UTF-8"?>\n'
                    f'{ElementTree.tostring(policy, encoding="unicode")}\n')


def read_policies(path: Path) -> dict[str, Access]:
    """Return each node's access by its name; DataError where the file is no such policy file."""
    try:
        profiles = ElementTree.parse(path).getroot().findall('enclaves/enclave/profiles/profile')
        return {profile.attrib['node']: {
            (kind, rule): frozenset(str(each.text) for each in profile.findall(
                f"{kind}s[@{rule}='ALLOW']/{kind}")) for kind, rule in _QUERIES}
            for profile in profiles}
    except (OSError, ElementTree.ParseError, KeyError) as error:
        raise DataError(f'{path}: not readable: expected SROS2 policies, got: {error}') from error


def differences(allowed: Mapping[str, Access], live: Mapping[str, Access]) -> list[str]:
    """Describe what is allowed but not used, and what is used but not allowed."""
    found = []
    for name in sorted(allowed.keys() | live.keys()):
        for kind, rule in _QUERIES:
            may = allowed.get(name, {}).get((kind, rule), frozenset())
            does = live.get(name, {}).get((kind, rule), frozenset())
            found += [f'{name}: may {rule} the {kind} {each}, but does not'
                     for each in sorted(may - does)]
            found += [f'{name}: does {rule} the {kind} {each}, but may not'
                     for each in sorted(does - may)]
    return found


def _relative(found: str, name: str, namespace: str) -> str:
    inside = namespace.rstrip('/') + '/'
    if found.startswith(f'{inside}{name}/'):
        return '~/' + found.removeprefix(f'{inside}{name}/')
    return found.removeprefix(inside)
