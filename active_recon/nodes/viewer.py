"""ROS node of the live page: it subscribes to the loop and shows it in the browser."""

from dataclasses import replace
from functools import partial
import math
import os

from active_recon.nodes.loop.followed_loop import Loop, LoopFinder
from active_recon.nodes.loop.loop_subscriber import LoopSubscriber
from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.parameters import Parameters
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import run_node
from active_recon.parameters.viewer import ViewerParameters
from active_recon.viewer.link import status_lines
from active_recon.viewer.page import Page
from rclpy.client import Client
from rclpy.task import Future
from std_srvs.srv import Trigger

BUTTONS = {'next_object': ('Next object', 'Show the camera the next object, in a new episode.'),
           'skip_goal': ('Skip goal', 'Leave the open goal out, and ask for the next best.'),
           'start_episode': ('New episode', 'Discard the reconstruction and begin an episode.'),
           'save_mesh': ('Save mesh', 'Save the object as a mesh, where the reconstructor runs.')}
TOPICS = ('camera/image_raw', 'camera/camera_info', 'camera/pose', 'view', 'views', 'occupancy',
          'probabilities', 'quality', 'mesh', 'network_image', 'next_view', 'azimuth_scores',
          'goal_reason', 'done', 'episode')
_DRAW_EVERY_S = 1 / 36
_STATUS_EVERY_S = 0.5


class ViewerNode(QosWarnings):
    """Observe the loop and show its state; call the services whose buttons are clicked."""

    def __init__(self) -> None:
        super().__init__('viewer')
        self._params = Parameters(self, ViewerParameters).values
        self._diagnostics = Diagnostics(self)
        self._loop = self._with_overrides(Loop(self.get_namespace(), has_size=False))
        self._page = Page('active_recon, live', self._loop.object_size, self._params.port)
        for label, hint in BUTTONS.values():
            self._page.add_button(label, hint)
        self._subscriber = LoopSubscriber(self, self._loop, self._diagnostics)
        self._triggers = self._make_clients()
        self._finder = LoopFinder(self, self._on_loop)
        self._update_status()
        self.create_timer(_DRAW_EVERY_S, self._draw, clock=STEADY)
        self.create_timer(_STATUS_EVERY_S, self._update_status, clock=STEADY)
        if self._page.port_taken:
            self.get_logger().warning(
                f'port {self._params.port} is in use; the page is at another')
        self.get_logger().info(f'the page is at {self._page.url}')
        self.get_logger().info('ready')

    def _with_overrides(self, loop: Loop) -> Loop:
        """Return a loop with this node's own parameters and remappings where they are given."""
        size, frame = self._params.object_size, self._params.object_frame
        own_namespace = self.get_namespace().rstrip('/')
        own = {name: self.resolve_topic_name(name) for name in (*TOPICS, *BUTTONS)}
        return replace(
            loop, object_size=loop.object_size if math.isnan(size) else size,
            has_size=loop.has_size or not math.isnan(size),
            object_frame=frame or loop.object_frame,
            names={name: loop.full_name(name) if full == f'{own_namespace}/{name}' else full
                   for name, full in own.items()})

    def _on_loop(self, found: Loop) -> None:
        """Observe a loop that was found, unless it is the current one."""
        loop = self._with_overrides(found)
        if loop == self._loop:
            return
        self._loop = loop
        self._subscriber.close()
        for client in self._triggers.values():
            self.destroy_client(client)
        self._page.set_object_size(loop.object_size)
        self._subscriber = LoopSubscriber(self, loop, self._diagnostics)
        self._triggers = self._make_clients()

    def _make_clients(self) -> dict[str, Client]:
        return {label: self.create_client(Trigger, self._loop.full_name(service))
                for service, (label, _) in BUTTONS.items()}

    def _draw(self) -> None:
        self._subscriber.update()
        for label in self._page.clicks():
            self._triggers[label].call_async(Trigger.Request()).add_done_callback(
                partial(self._on_answer, label))
        self._page.draw(self._subscriber.observer.state)

    def _on_answer(self, label: str, answer: Future) -> None:
        response = answer.result()
        self._page.notify(label if response.success else f'{label}: failed', response.message)

    def _update_status(self) -> None:
        self._finder.update()
        lines = status_lines(
            self._subscriber.links(), self._subscriber.observer.state, self._subscriber.problems())
        if self._finder.others:
            lines.append(f'There are loops in {", ".join(self._finder.others)}; select one with '
                         f'-r __ns:={self._finder.others[0]}.')
        self._page.set_text(lines)
        for label, service in self._triggers.items():
            self._page.enable(label, service.service_is_ready())

    def destroy_node(self) -> None:
        """Stop serving the page, and end."""
        self._page.close()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the viewer until it is asked to stop."""
    # The viewer yields to the loop where CPU time is short
    os.nice(10)
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    run_node(ViewerNode, args)


if __name__ == '__main__':
    main()
