"""Collects the parameters of other nodes as they appear."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
import time

from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters, GetParameterTypes, ListParameters
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.task import Future

REQUEST_AGAIN_S = 2.0
"""A request may be lost where its node has just ended; it is then repeated."""


@dataclass(frozen=True)
class _Clients:
    """Clients that read one node's parameters; rclpy's own client could set them as well."""

    names: Client
    types: Client
    values: Client

    @classmethod
    def of(cls, node: Node, name: str) -> '_Clients':
        return cls(node.create_client(ListParameters, f'{name}/list_parameters'),
                   node.create_client(GetParameterTypes, f'{name}/get_parameter_types'),
                   node.create_client(GetParameters, f'{name}/get_parameters'))

    @property
    def are_ready(self) -> bool:
        return all(each.service_is_ready() for each in (self.names, self.types, self.values))


class ParameterCollector:
    """
    Requests all parameters of each node, and passes them on when they have arrived.

    `on_parameters` is called with the node's full name and a mapping of parameter to value.
    Nothing blocks: a node that never answers costs a request every `REQUEST_AGAIN_S` seconds.
    """

    def __init__(self, node: Node,
                 on_parameters: Callable[[str, dict[str, object]], None]) -> None:
        self._node = node
        self._on_parameters = on_parameters
        self._clients: dict[str, _Clients] = {}
        self._requested_at: dict[str, float] = {}
        self._known: set[str] = set()
        self._forgotten: Counter[str] = Counter()

    def forget(self, name: str | None = None) -> None:
        """Request the parameters of a node again, or of every node."""
        for each in set(self._clients) if name is None else {name}:
            self._known.discard(each)
            self._requested_at.pop(each, None)
            self._forgotten[each] += 1  # a pending answer is out of date

    def request(self, names: Iterable[str]) -> None:
        """Request the parameters of nodes that are running and not known; call repeatedly."""
        running = set(names)
        self._known &= running  # a node that restarts may have other parameters
        for name in running - self._known:
            now = time.monotonic()
            if now - self._requested_at.get(name, -REQUEST_AGAIN_S) < REQUEST_AGAIN_S:
                continue
            if name not in self._clients:
                self._clients[name] = _Clients.of(self._node, name)
            clients = self._clients[name]
            if clients.are_ready:
                self._requested_at[name] = now
                clients.names.call_async(ListParameters.Request()).add_done_callback(
                    partial(self._request_types, name, self._forgotten[name]))

    def _request_types(self, name: str, forgotten: int, listed: Future) -> None:
        answer = listed.result()
        if answer is not None and self._is_awaited(name, forgotten):
            names = list(answer.result.names)
            request = GetParameterTypes.Request(names=names)
            self._clients[name].types.call_async(request).add_done_callback(
                partial(self._request_values, name, forgotten, names))

    def _request_values(self, name: str, forgotten: int, names: list[str], typed: Future) -> None:
        """Request the parameters that are set: one that is not makes a node return none."""
        answer = typed.result()
        if answer is None or len(answer.types) != len(names) or not self._is_awaited(
                name, forgotten):
            return
        known = [each for each, kind in zip(names, answer.types, strict=True)
                 if kind != ParameterType.PARAMETER_NOT_SET]
        self._clients[name].values.call_async(GetParameters.Request(
            names=known)).add_done_callback(partial(self._take, name, forgotten, known))

    def _take(self, name: str, forgotten: int, names: list[str], got: Future) -> None:
        answer = got.result()
        if answer is None or len(answer.values) != len(names):
            return
        if not self._is_awaited(name, forgotten):
            return
        del self._requested_at[name]
        self._known.add(name)
        self._on_parameters(name, dict(zip(
            names, map(parameter_value_to_python, answer.values), strict=True)))

    def _is_awaited(self, name: str, forgotten: int) -> bool:
        """Return whether an answer is to the last request: none was forgotten since."""
        return name in self._requested_at and self._forgotten[name] == forgotten
