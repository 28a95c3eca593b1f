"""The parameters of other nodes, asked for as the nodes appear."""

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

ASK_AGAIN_S = 2.0
"""A request may go to a node that has just ended; after that time it is sent again."""


@dataclass(frozen=True)
class _Clients:
    """What reads the parameters of one node; rclpy's own client could set them as well."""

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


class AskedParameters:
    """
    Asks each node for all its parameters, and hands them on once they are known.

    `on_known` is called with the node's full name and a mapping of parameter to value. Nothing
    waits: a node that never answers costs a request every `ASK_AGAIN_S` seconds.
    """

    def __init__(self, node: Node, on_known: Callable[[str, dict[str, object]], None]) -> None:
        self._node = node
        self._on_known = on_known
        self._clients: dict[str, _Clients] = {}
        self._asked_at: dict[str, float] = {}
        self._known: set[str] = set()
        self._forgotten: Counter[str] = Counter()

    def forget(self, name: str | None = None) -> None:
        """Ask a node anew, or every node."""
        for each in set(self._clients) if name is None else {name}:
            self._known.discard(each)
            self._asked_at.pop(each, None)
            self._forgotten[each] += 1  # an answer that is on its way tells what was

    def ask(self, names: Iterable[str]) -> None:
        """Ask those of the nodes that are there now and not yet known; called again and again."""
        there = set(names)
        self._known &= there  # who goes and comes back may have changed
        for name in there - self._known:
            now = time.monotonic()
            if now - self._asked_at.get(name, -ASK_AGAIN_S) < ASK_AGAIN_S:
                continue
            if name not in self._clients:
                self._clients[name] = _Clients.of(self._node, name)
            clients = self._clients[name]
            if clients.are_ready:
                self._asked_at[name] = now
                clients.names.call_async(ListParameters.Request()).add_done_callback(
                    partial(self._ask_types, name, self._forgotten[name]))

    def _ask_types(self, name: str, forgotten: int, listed: Future) -> None:
        answer = listed.result()
        if answer is not None and self._is_awaited(name, forgotten):
            names = list(answer.result.names)
            self._clients[name].types.call_async(GetParameterTypes.Request(
                names=names)).add_done_callback(partial(self._ask_values, name, forgotten, names))

    def _ask_values(self, name: str, forgotten: int, names: list[str], typed: Future) -> None:
        """Ask for those that have a value: one without keeps a node from telling any."""
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
        del self._asked_at[name]
        self._known.add(name)
        self._on_known(name, dict(zip(
            names, map(parameter_value_to_python, answer.values), strict=True)))

    def _is_awaited(self, name: str, forgotten: int) -> bool:
        """Return whether an answer to what was asked after so many times of forgetting counts."""
        return name in self._asked_at and self._forgotten[name] == forgotten
