"""Asks the nodes that run on this ROS domain: services, parameters, diagnostics."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
import os
import re
import time
from typing import Any

from active_recon.errors import ConfigError
from active_recon.launching.loop_client import joined_domain, LoopClient
from active_recon.nodes.runtime.hidden_nodes import is_hidden
from active_recon.nodes.runtime.qos import endpoint_node, NOTHING_COMES, SENSOR_QOS
from active_recon.parameters.declaration import nearest
from active_recon.parameters.value_text import value_from_text
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import Trigger

_ANSWER_S = 60.0  # a mesh takes seconds, more on a busy machine
_SETTLE_S = 0.2  # a service that does not know its client yet answers to nobody
_DISCOVERY_S = 2.0
_LEVELS = {DiagnosticStatus.OK: 'OK', DiagnosticStatus.WARN: 'WARN',
           DiagnosticStatus.ERROR: 'ERROR', DiagnosticStatus.STALE: 'STALE'}


@dataclass(frozen=True)
class Change:
    """A parameter's value before and after; `refusal` is the node's reason to keep it, or ''."""

    node: str
    before: object
    after: object
    refusal: str = ''


@dataclass(frozen=True)
class NodeReading:
    """What a node tells of itself: OK, WARN, ERROR or STALE, with a message and values."""

    name: str
    level: str
    message: str
    values: Mapping[str, str]


class RunningNodes(LoopClient):
    """
    Talks to running nodes; relative names are in the namespace.

    What is not on the domain after `timeout_s` seconds is missing: a ConfigError, which names
    what was found instead.
    """

    def __init__(self, node: Node, executor: SingleThreadedExecutor, namespace: str,
                 timeout_s: float) -> None:
        super().__init__(node, executor)
        self._namespace = namespace.strip('/')
        self._timeout_s = timeout_s

    def call(self, service: str) -> tuple[bool, str]:
        """Call a Trigger service; return its success and message."""
        name = self._full_name(service)
        if not self._appears(lambda: name in self._offered('std_srvs/srv/Trigger')):
            raise self._missing(f'service {name}', 'a Trigger service of a running node',
                                self._offered('std_srvs/srv/Trigger'))
        answer = self._ask(Trigger, name, Trigger.Request())
        return answer.success, answer.message

    def set_parameter(self, node: str, name: str, text: str) -> Change:
        """Set a parameter of a node to a value in YAML; ConfigError where it has none so named."""
        node = self._full_name(node)
        if not self._appears(lambda: node in self._nodes()):
            raise self._missing(f'node {node}', 'a running node with parameters', self._nodes())
        msg = self._value(node, name)
        before = parameter_value_to_python(msg)
        value = value_from_text(text, before)
        # An empty list does not tell what it is a list of
        kind = Parameter.Type(msg.type) if value == [] and isinstance(before, list) else None
        request = SetParameters.Request(
            parameters=[Parameter(name, kind, value).to_parameter_msg()])
        result, = self._ask(SetParameters, f'{node}/set_parameters', request).results
        if not result.successful:
            return Change(node, before, before, _refusal(result.reason, name))
        return Change(node, before, parameter_value_to_python(self._value(node, name)))

    def read_status(self) -> tuple[list[NodeReading], list[str]]:
        """
        Return what each node tells of itself, and the names of nodes that told nothing.

        They are the nodes in the namespace, or all where that is ''.
        """
        heard: dict[str, NodeReading] = {}
        readings: dict[str, NodeReading] = {}

        def take(msg: DiagnosticArray) -> None:
            heard.update((each.name, NodeReading(
                each.name, _LEVELS.get(each.level, '?'), each.message,
                {pair.key: pair.value for pair in each.values})) for each in msg.status)
            readings.update((name, each) for name, each in heard.items() if self._is_asked(name))

        def publishers() -> set[str | None]:
            return set(map(endpoint_node,
                           self._node.get_publishers_info_by_topic('/diagnostics')))

        def silent() -> list[str]:
            return sorted(
                name for name in publishers() if name and not is_hidden(name)
                and self._is_asked(name) and not any(_tells_of(each, name) for each in heard))

        self._node.create_subscription(DiagnosticArray, '/diagnostics', take, SENSOR_QOS)
        discovered_at = time.monotonic() + _DISCOVERY_S
        self._appears(lambda: bool(readings) and not silent()
                      and time.monotonic() > discovered_at)
        if not readings and not silent():
            if None in publishers():
                raise ConfigError('no diagnostics: expected those of a running node, found a node '
                                  f'of {NOTHING_COMES}')
            where = f' in the namespace /{self._namespace}' if self._namespace else ''
            raise self._missing(f'diagnostics{where}', 'a running node', sorted(heard))
        return [readings[name] for name in sorted(readings)], silent()

    def _is_asked(self, name: str) -> bool:
        """Return whether a node is in the namespace, or in one below it."""
        return not self._namespace or name.lstrip('/').startswith(f'{self._namespace}/')

    def _full_name(self, name: str) -> str:
        if name.startswith('/'):
            return name
        return '/' + '/'.join(filter(None, (self._namespace, name)))

    def _appears(self, condition: Callable[[], bool]) -> bool:
        return self.within(condition, self._timeout_s, _nothing)

    def _offered(self, kind: str) -> list[str]:
        return sorted(name for name, kinds in self._node.get_service_names_and_types()
                      if kind in kinds)

    def _nodes(self) -> list[str]:
        """Return the nodes whose parameters can be set, without hidden ones, such as this one."""
        services = self._offered('rcl_interfaces/srv/SetParameters')
        return [node for node, slash, name in (each.rpartition('/') for each in services)
                if name == 'set_parameters' and not is_hidden(node)]

    def _missing(self, what: str, kind: str, found: list[str]) -> ConfigError:
        if found:
            return ConfigError(
                f'no {what}: expected {kind}, found {", ".join(found)}; name one with its '
                'namespace, or start (and configure) the node that is missing')
        domain = os.environ.get('ROS_DOMAIN_ID', '0')
        return ConfigError(
            f'no {what}: expected {kind}, found none within {self._timeout_s:g} s on ROS domain '
            f'{domain}; start the nodes, or set ROS_DOMAIN_ID to the domain that they are on')

    def _ask(self, kind: Any, service: str, request: Any) -> Any:
        return self._call(kind, service, request, _ANSWER_S, _nothing, _SETTLE_S)

    def _value(self, node: str, name: str) -> ParameterValue:
        values = self._ask(GetParameters, f'{node}/get_parameters',
                           GetParameters.Request(names=[name])).values
        if values:
            return values[0]
        known = self._ask(ListParameters, f'{node}/list_parameters',
                          ListParameters.Request()).result.names
        if name in known:  # declared, without a value
            return ParameterValue()
        raise ConfigError(f'{node} has no parameter {name}; {nearest(name, known)}')


@contextmanager
def running_nodes(namespace: str = '', timeout_s: float = 5.0) -> Iterator[RunningNodes]:
    """Join the ROS domain of the environment to ask its nodes."""
    with joined_domain(f'_command_{os.getpid()}') as (node, executor):
        yield RunningNodes(node, executor, namespace, timeout_s)


def _tells_of(status: str, node: str) -> bool:
    """Return whether a status is of a node: its full name; others begin theirs with `node`."""
    own = re.split(r'[^\w/]', status, maxsplit=1)[0]
    return own in (node, node.lstrip('/'), node.rpartition('/')[2])


def _refusal(reason: str, name: str) -> str:
    """Return a node's reason not to set a parameter, with what to do about one that is fixed."""
    if 'read-only' not in reason:
        return reason or 'refused without a reason'
    return f'{reason.rstrip(".")}: set it where the node is started, by -p {name}:=VALUE'


def _nothing() -> None:
    pass
