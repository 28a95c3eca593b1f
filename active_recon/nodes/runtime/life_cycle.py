"""Life-cycle nodes: what a transition makes is destroyed by its opposite."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
import gc
import traceback
from typing import Any

from active_recon.errors import ActiveReconError, ConfigError
from active_recon.nodes.runtime.clock import ClockWatch
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.parameters import ReadOnlySaysWhy
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import one_line, run_node
from lifecycle_msgs.srv import ChangeState
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

RCLError = rclpy_implementation.RCLError


class ManagedNode(ReadOnlySaysWhy, QosWarnings, LifecycleNode, ABC):
    """
    A node that is unconfigured, inactive, active or finalized.

    A subclass says in `configure` what it loads and offers, and in `activate` what it hears and
    when it works. Publishers, subscriptions, services, clients and timers that are made there are
    destroyed by the opposite transition, and what `configure` added to the node's attributes is
    forgotten: unconfigured, the node holds nothing. Either may raise ActiveReconError: the
    transition then fails and says why in the log and the diagnostics, and the state stays.
    """

    def __init__(self, name: str) -> None:
        self._configured, self._activated = ExitStack(), ExitStack()
        self._being_made: ExitStack | None = None
        self._before: frozenset[str] | None = None
        self._failure: Exception | None = None
        self._is_starting = False
        self.is_configured = False
        self.is_active = False
        super().__init__(name)
        self._service_change_state.callback = partial(
            self._refuse_impossible, self._service_change_state.callback)
        self._diagnostics = Diagnostics(self)
        self._tell_state()

    @abstractmethod
    def configure(self) -> None:
        """Load, and offer topics and services."""

    @abstractmethod
    def activate(self) -> None:
        """Begin to hear and to work."""

    @abstractmethod
    def clock_went_back(self, how: str) -> None:
        """Begin anew while active; `how` says in words what the clock did."""

    def on_undo(self, undo: Callable[[], Any]) -> None:
        """Let the opposite of the transition that is being made call `undo`."""
        assert self._being_made is not None
        self._being_made.callback(undo)

    def start(self) -> None:
        """Become active without being told; raises what kept the node from it."""
        self._is_starting = True
        for trigger in (self.trigger_configure, self.trigger_activate):
            trigger()
            if self._failure is not None:
                raise self._failure
        self._is_starting = False

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Configure, or hold nothing."""
        self._before = frozenset(vars(self))
        result = self._transit('configure', self.configure, self._configured)
        self.is_configured = result == TransitionCallbackReturn.SUCCESS
        if not self.is_configured:
            self._free()
        self._tell_state()
        return result

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Activate, or hear nothing."""
        result = self._transit('activate', self._activate, self._activated)
        self.is_active = result == TransitionCallbackReturn.SUCCESS
        if self.is_active:
            self.get_logger().info('ready')
        self._tell_state()
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Hear nothing more."""
        self.is_active = False
        self._activated.close()
        self._tell_state()
        return TransitionCallbackReturn.SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Free what configuring took."""
        self.on_deactivate(state)
        self.is_configured = False
        self._free()
        self._tell_state()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Free everything; what is left is a node that waits to be ended."""
        result = self.on_cleanup(state)
        self._diagnostics.tell('State', 'finalized')
        return result

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Free everything; the node can be configured again."""
        return self.on_cleanup(state)

    def _activate(self) -> None:
        self.clock_watch = ClockWatch(self, self.clock_went_back)
        self.on_undo(self.clock_watch.close)
        self.activate()

    def _transit(self, name: str, make: Callable[[], None],
                 undo: ExitStack) -> TransitionCallbackReturn:
        self._being_made, self._failure = undo, None
        try:
            make()
        except ActiveReconError as error:
            self._tell_failure(error, f'{name} failed: {one_line(error)}')
            undo.close()
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # rclpy would pass over it in silence
            self._tell_failure(error, f'{name} failed: {traceback.format_exc()}')
            undo.close()
            return TransitionCallbackReturn.ERROR
        finally:
            self._being_made = None
        self._diagnostics.recover()
        return TransitionCallbackReturn.SUCCESS

    def _tell_failure(self, error: Exception, message: str) -> None:
        self._failure = error
        if not self._is_starting:  # then the process ends with it
            self._diagnostics.fail('transition', message)

    def _tell_state(self) -> None:
        self._diagnostics.tell('State', 'active' if self.is_active else
                               'inactive' if self.is_configured else 'unconfigured')

    def _free(self) -> None:
        self._configured.close()
        self._diagnostics.forget()
        if self._before is not None:
            for name in vars(self).keys() - self._before:
                delattr(self, name)
            self._before = None
        gc.collect()

    def _refuse_impossible(self, change: Callable[..., ChangeState.Response],
                           request: ChangeState.Request,
                           response: ChangeState.Response) -> ChangeState.Response:
        """Answer that a transition failed which rclpy, asked by its number, would not survive."""
        try:
            return change(request, response)
        except RCLError as error:
            self._diagnostics.refuse(ConfigError(one_line(error), 'transition'))
            return response

    def _undone_later(self, made: Any, destroy: Callable[[Any], Any]) -> Any:
        if self._being_made is not None:
            self._being_made.callback(destroy, made)
        return made

    def create_publisher(self, *args: Any, **kwargs: Any) -> Any:
        """See rclpy's Node, as for all that follow."""
        return self._undone_later(
            super().create_publisher(*args, **kwargs), self.destroy_publisher)

    def create_subscription(self, *args: Any, **kwargs: Any) -> Any:
        return self._undone_later(
            super().create_subscription(*args, **kwargs), self.destroy_subscription)

    def create_service(self, *args: Any, **kwargs: Any) -> Any:
        return self._undone_later(super().create_service(*args, **kwargs), self.destroy_service)

    def create_client(self, *args: Any, **kwargs: Any) -> Any:
        return self._undone_later(super().create_client(*args, **kwargs), self.destroy_client)

    def create_timer(self, *args: Any, **kwargs: Any) -> Any:
        return self._undone_later(super().create_timer(*args, **kwargs), self.destroy_timer)

    def destroy_node(self) -> None:
        """Free everything, then the node itself."""
        self._activated.close()
        self._configured.close()
        super().destroy_node()


def run_managed_node(make_node: Callable[[], ManagedNode],
                     args: list[str] | None = None) -> None:
    """
    Run a life-cycle node as `run_node` runs any; where its parameter says so, it starts itself.

    A node that starts itself and cannot ends the process; one that is told to later does not.
    """
    def started() -> ManagedNode:
        node = make_node()
        try:
            if node.get_parameter('autostart').value:
                node.start()
            else:
                node.get_logger().info('unconfigured; waits to be configured and activated')
        except BaseException:
            node.destroy_node()
            raise
        return node

    run_node(started, args)
