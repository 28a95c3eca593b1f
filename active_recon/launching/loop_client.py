"""A client of the loop, in the process that started its nodes."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import time
from typing import Any

from active_recon.errors import ActiveReconError
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

_SPIN_S = 0.05


class LoopClient:
    """Waits for conditions while its node spins, and calls the loop's services."""

    def __init__(self, node: Node, executor: SingleThreadedExecutor) -> None:
        self._node = node
        self._executor = executor

    def until(self, condition: Callable[[], bool], budget_s: float, awaited: str,
              meanwhile: Callable[[], None]) -> None:
        """Spin until the condition holds; ActiveReconError after the budget."""
        if not self.within(condition, budget_s, meanwhile):
            raise ActiveReconError(f'timed out: expected {awaited} within {budget_s:g} s, '
                                   f'but it did not arrive{self.problems_told()}')

    def problems_told(self) -> str:
        """Return what is known of why something did not arrive, to end a line; '' of nothing."""
        return ''

    def within(self, condition: Callable[[], bool], budget_s: float,
               meanwhile: Callable[[], None]) -> bool:
        """Spin until the condition holds or the budget is used; return whether it holds."""
        deadline = time.monotonic() + budget_s
        while not condition():
            if time.monotonic() > deadline:
                return False
            self._executor.spin_once(timeout_sec=_SPIN_S)
            meanwhile()
        return True

    def trigger(self, service: str, budget_s: float, meanwhile: Callable[[], None]) -> str:
        """Call a Trigger service and return its message; ActiveReconError where it fails."""
        result = self._call(Trigger, service, Trigger.Request(), budget_s, meanwhile)
        if not result.success:
            raise ActiveReconError(f'{service} answered: {result.message}')
        return str(result.message)

    def _call(self, kind: Any, service: str, request: Any, budget_s: float,
              meanwhile: Callable[[], None], settle_s: float = 0.0) -> Any:
        """
        Call a service and return its response; ActiveReconError after the budget.

        The call is made `settle_s` seconds after the service was found.
        """
        client = self._node.create_client(kind, service)
        try:
            self.until(client.service_is_ready, budget_s, f'the service {service}', meanwhile)
            if settle_s:
                self.within(lambda: False, settle_s, meanwhile)
            answer = client.call_async(request)
            self.until(answer.done, budget_s, f'an answer of {service}', meanwhile)
            return answer.result()
        finally:
            self._node.destroy_client(client)


@contextmanager
def joined_domain(name: str) -> Iterator[tuple[Node, SingleThreadedExecutor]]:
    """Join the ROS domain of the environment with a node and its executor."""
    context = Context()
    # No log file, for which a user without a home, as in a container, has no folder. Ctrl-C raises
    # KeyboardInterrupt here, so that the caller can clean up
    rclpy.init(args=['--ros-args', '--disable-external-lib-logs'], context=context,
               signal_handler_options=SignalHandlerOptions.NO)
    node = Node(name, context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        yield node, executor
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
