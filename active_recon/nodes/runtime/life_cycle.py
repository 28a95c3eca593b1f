"""Lifecycle nodes: a transition's entities are destroyed by the opposite transition."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
import gc
import traceback
from typing import Any

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.nodes.runtime.clock import ClockMonitor
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import one_line, run_node
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn


class ManagedNode(QosWarnings, LifecycleNode, ABC):
    """
    A node that is unconfigured, inactive, active or finalized.

    A subclass loads its network and creates publishers and services in `configure`, and creates
    subscriptions and timers in `activate`. Publishers, subscriptions, services, clients and
    timers created there are destroyed by the opposite transition, which also calls what was
    given to `add_cleanup`. Either may raise ActiveReconError: the transition then fails, with the
    reason in the log and the diagnostics, and the state stays.
    """

    def __init__(self, name: str) -> None:
        self._configured, self._activated = ExitStack(), ExitStack()
        self._cleanups: ExitStack | None = None
        self._failure: Exception | None = None
        self._is_starting = False
        self.is_configured = False
        self.is_active = False
        super().__init__(name)
        self._service_change_state.callback = partial(
            self._reject_impossible, self._service_change_state.callback)
        self._diagnostics = Diagnostics(self)
        self._publish_state()

    @abstractmethod
    def configure(self) -> None:
        """Load what the node needs, create publishers and services."""

    @abstractmethod
    def activate(self) -> None:
        """Create subscriptions and timers."""

    @abstractmethod
    def clock_went_back(self, how: str) -> None:
        """Start over after a jump of the clock while active; `how` describes it."""

    def add_cleanup(self, cleanup: Callable[[], Any]) -> None:
        """Let the opposite of the current transition call `cleanup`."""
        assert self._cleanups is not None
        self._cleanups.callback(cleanup)

    def start(self, to_active: bool) -> None:
        """Configure and, `to_active`, activate itself; raises the error that prevents it."""
        self._is_starting = True
        then = [self.trigger_activate] if to_active else []
        for trigger in (self.trigger_configure, *then):
            trigger()
            if self._failure is not None:
                raise self._failure
        self._is_starting = False

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure, with counters at 0; where that fails, free everything again."""
        self._diagnostics.forget_counts()
        result = self._transit('configure', self.configure, self._configured)
        self.is_configured = result == TransitionCallbackReturn.SUCCESS
        if not self.is_configured:
            self._free()
        self._publish_state()
        return result

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Activate; where that fails, end all subscriptions again."""
        result = self._transit('activate', self._activate, self._activated)
        self.is_active = result == TransitionCallbackReturn.SUCCESS
        if self.is_active:
            self.get_logger().info('ready')
        self._publish_state()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy what `activate` created."""
        self.is_active = False
        self._activated.close()
        self._publish_state()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy what `configure` created; in the diagnostics only the counters stay."""
        result = self.on_error(state)
        self._diagnostics.clear_error()
        return result

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy everything; the node can no longer be configured."""
        result = self.on_cleanup(state)
        self._diagnostics.set_value('State', 'finalized')
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Destroy everything; the node can be configured again, and its error is still told."""
        self.on_deactivate(state)
        self.is_configured = False
        self._free()
        self._publish_state()
        return TransitionCallbackReturn.SUCCESS

    def _activate(self) -> None:
        self.clock_monitor = ClockMonitor(self, self.clock_went_back)
        self.add_cleanup(self.clock_monitor.close)
        self.activate()

    def _transit(self, name: str, make: Callable[[], None],
                 undo: ExitStack) -> TransitionCallbackReturn:
        self._cleanups, self._failure = undo, None
        try:
            make()
        except ActiveReconError as error:
            self._report_failure(error, f'{name} failed: {one_line(error)}')
            undo.close()
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # rclpy would ignore it silently
            self._report_failure(error, f'{name} failed: {traceback.format_exc()}')
            undo.close()
            return TransitionCallbackReturn.ERROR
        finally:
            self._cleanups = None
        self._diagnostics.clear_error()
        return TransitionCallbackReturn.SUCCESS

    def _report_failure(self, error: Exception, message: str) -> None:
        self._failure = error
        if not self._is_starting:  # else the process ends with it
            self._diagnostics.raise_error('transition', message)

    def _publish_state(self) -> None:
        self._diagnostics.set_value('State', 'active' if self.is_active else
                               'inactive' if self.is_configured else 'unconfigured')

    def _free(self) -> None:
        self._configured.close()
        self._diagnostics.reset()
        gc.collect()

    def _reject_impossible(self, change: Callable[..., ChangeState.Response],
                           request: ChangeState.Request,
                           response: ChangeState.Response) -> ChangeState.Response:
        """Answer failure to a transition that the state lacks, on which rclpy would raise."""
        asked, machine = request.transition, self._state_machine
        possible = {number: label for number, label, *_ in machine.available_transitions}
        # As in rclpy, a label counts where both are given
        if asked.label in possible.values() if asked.label else asked.id in possible:
            return change(request, response)
        known = {number: label for number, label, *_ in machine.transition_graph}
        choices = ' or '.join(f'{label} ({number})' for number, label in possible.items())
        got = asked.label or f'{known.get(asked.id, "an unknown one")} ({asked.id})'
        self._diagnostics.reject(ConfigError(
            f'no such transition of a node that is {machine.current_state[1]}: expected '
            f'{choices or "none"}, got {got}', 'transition'), log_each=True)
        return response

    def _destroyed_later(self, entity: Any, destroy: Callable[[Any], Any]) -> Any:
        if self._cleanups is not None:
            self._cleanups.callback(destroy, entity)
        return entity

    def create_publisher(self, *args: Any, **kwargs: Any) -> Any:
        """See rclpy's Node, as for all that follow."""
        return self._destroyed_later(
            super().create_publisher(*args, **kwargs), self.destroy_publisher)

    def create_subscription(self, *args: Any, **kwargs: Any) -> Any:
        return self._destroyed_later(
            super().create_subscription(*args, **kwargs), self.destroy_subscription)

    def create_service(self, *args: Any, **kwargs: Any) -> Any:
        return self._destroyed_later(super().create_service(*args, **kwargs), self.destroy_service)

    def create_client(self, *args: Any, **kwargs: Any) -> Any:
        return self._destroyed_later(super().create_client(*args, **kwargs), self.destroy_client)

    def create_timer(self, *args: Any, **kwargs: Any) -> Any:
        return self._destroyed_later(super().create_timer(*args, **kwargs), self.destroy_timer)

    def destroy_node(self) -> None:
        """Free everything, then the node itself."""
        self._activated.close()
        self._configured.close()
        super().destroy_node()


def managed(make_node: Callable[[], ManagedNode]) -> Callable[[], ManagedNode]:
    """
    Return what makes a lifecycle node, which with `autostart` configures and activates itself.

    Without `activate_at_start` it only configures itself. An autostart that fails raises; a
    transition that is requested and fails does not.
    """
    def started() -> ManagedNode:
        node = make_node()
        try:
            if node.get_parameter('autostart').value:
                node.start(bool(node.get_parameter('activate_at_start').value))
                if not node.is_active:
                    node.get_logger().info('configured; waiting to be activated')
            else:
                node.get_logger().info('unconfigured; waiting to be configured and activated')
        except BaseException:
            node.destroy_node()
            raise
        return node

    return started


def run_managed_node(make_node: Callable[[], ManagedNode],
                     args: list[str] | None = None) -> None:
    """Run a lifecycle node with `run_node`, made by `managed`."""
    run_node(managed(make_node), args)
