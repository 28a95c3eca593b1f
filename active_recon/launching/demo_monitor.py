"""The demo's own node: it observes the loop and calls its services."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from active_recon.errors import ActiveReconError
from active_recon.launching.loop_client import joined_domain, LoopClient
from active_recon.nodes.loop.followed_loop import Loop
from active_recon.nodes.loop.loop_subscriber import LoopSubscriber
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.viewer.state import LoopState, Observer
from active_recon.viewer.view_result import ViewResult
from active_recon.volumes.voxels import iou, VoxelGrid
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.srv import SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

RECORDED = ('camera/image_raw', 'camera/camera_info', 'camera/pose', 'next_view', 'view')
"""What the recorder has to hear from its first message on, for its bag to be replayed."""
TrueCells = Callable[[int], NDArray[np.bool_]]
"""Returns the object's true cells, (N, N, N), for N cells a side."""


class ScoringObserver(Observer):
    """Adds the occupied cells and their IoU with the true object to each view."""

    def __init__(self, truth: TrueCells) -> None:
        super().__init__()
        self._truth = truth

    def add_view(self, view: ViewResult, grid: VoxelGrid | None,
                 occupied: VoxelGrid | None) -> None:
        """Add a view with the probabilities and the occupied cells after it."""
        if grid is not None and occupied is not None:
            cells = occupied.as_fine_as(grid)
            truth = self._truth(len(cells.occupancy))
            view = replace(view, occupied=cells, iou=float(iou(cells.occupied(0), truth)))
        super().add_view(view, grid, occupied)


class DemoMonitor(LoopClient):
    """Waits for the loop and calls its services; `state` is the loop's, each view with its IoU."""

    def __init__(self, node: Node, executor: SingleThreadedExecutor, truth: TrueCells) -> None:
        super().__init__(node, executor)
        self._subscriber = LoopSubscriber(
            node, Loop(node.get_namespace()), Diagnostics(node), ScoringObserver(truth))

    @property
    def state(self) -> LoopState:
        """The state of the loop now."""
        return self._subscriber.observer.state

    def has_views(self, count: int) -> bool:
        """Return whether so many views have been received."""
        return len(self.state.views) >= count

    def is_done(self) -> bool:
        """Return whether the planner has ended the episode."""
        return self.state.done != ''

    def is_recorded(self) -> bool:
        """Return whether the recorder has subscribed to all that the loop's nodes publish."""
        return all('recorder' in {each.node_name for each in
                                  self._node.get_subscriptions_info_by_topic(topic)}
                   for topic in RECORDED)

    def problems_told(self) -> str:
        """Return the problems that the loop's nodes report, to end a line; '' where none does."""
        return ''.join(f'; {node}: {problem}'
                       for node, problem in self._subscriber.problems().items())

    def change_state(self, node: str, transition: str, budget_s: float,
                     meanwhile: Callable[[], None]) -> bool:
        """Let a lifecycle node 'configure' or 'activate'; return whether it did."""
        service = f'{node}/change_state'
        request = ChangeState.Request(transition=Transition(label=transition))
        return bool(self._call(ChangeState, service, request, budget_s, meanwhile).success)

    def set_parameter(self, node: str, name: str, value: str, budget_s: float,
                      meanwhile: Callable[[], None]) -> None:
        """Set a parameter of a node; ActiveReconError where it refuses the value."""
        request = SetParameters.Request(
            parameters=[Parameter(name, value=value).to_parameter_msg()])
        service = f'{node}/set_parameters'
        result, = self._call(SetParameters, service, request, budget_s, meanwhile).results
        if not result.successful:
            raise ActiveReconError(f'{service} answered: {result.reason}')

    def within(self, condition: Callable[[], bool], budget_s: float,
               meanwhile: Callable[[], None]) -> bool:
        """Read messages until the condition holds or the budget is used."""
        def update() -> None:
            self._subscriber.update()
            meanwhile()

        return super().within(condition, budget_s, update)


@contextmanager
def demo_monitor(truth: TrueCells) -> Iterator[DemoMonitor]:
    """Join the ROS domain of the environment as an observer that knows the true object."""
    with joined_domain('_demo') as (node, executor):
        yield DemoMonitor(node, executor, truth)
