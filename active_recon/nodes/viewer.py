"""ROS shell of the page: it hears the loop as anyone would, and shows it in the browser."""

from dataclasses import replace
from functools import partial
import math
import os

from active_recon.nodes.loop.followed_loop import Loop, LoopFinder
from active_recon.nodes.loop.loop_subscriber import HeardLoop
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.parameters import Parameters, ReadOnlySaysWhy
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import run_node
from active_recon.parameters.viewer import ViewerSettings
from active_recon.viewer.link import link_words
from active_recon.viewer.page import Page
from rclpy.client import Client
from rclpy.task import Future
from std_srvs.srv import Trigger

BUTTONS = {'next_object': ('Next object', 'Show the camera the next object, as a new episode.'),
           'start_episode': ('New episode', 'Forget the object and begin again.'),
           'save_mesh': ('Save mesh', 'Write the object as a mesh, where the reconstructor runs.')}
TOPICS = ('camera/image_raw', 'camera/camera_info', 'camera/pose', 'view', 'occupancy',
          'probabilities', 'network_image', 'next_view', 'azimuth_scores', 'done', 'episode')
_FOLLOW_EVERY_S = 1 / 36
_TELL_EVERY_S = 0.5


class ViewerNode(ReadOnlySaysWhy, QosWarnings):
    """Follow the loop from outside and draw what is known of it; ask for what is clicked."""

    def __init__(self) -> None:
        super().__init__('viewer')
        self._settings = Parameters(self, ViewerSettings).now
        self._diagnostics = Diagnostics(self)
        self._loop = self._as_told(Loop(self.get_namespace()))
        self._page = Page('active_recon, live', self._loop.object_size, self._settings.port)
        for label, hint in BUTTONS.values():
            self._page.add_button(label, hint)
        self._heard = HeardLoop(self, self._loop, self._diagnostics)
        self._askable = self._askers()
        self._finder = LoopFinder(self, self._follow)
        self._tell()
        self.create_timer(_FOLLOW_EVERY_S, self._draw)
        self.create_timer(_TELL_EVERY_S, self._tell)
        if self._page.port_taken:
            self.get_logger().warning(
                f'port {self._settings.port} is taken, so the page is at another')
        self.get_logger().info(f'the page is at {self._page.url}')
        self.get_logger().info('ready')

    def _as_told(self, loop: Loop) -> Loop:
        """Return a loop as this node's own parameters and names say that it is, where they do."""
        size, frame = self._settings.object_size, self._settings.object_frame
        usual = self.get_namespace().rstrip('/')
        own = {name: self.resolve_topic_name(name) for name in (*TOPICS, *BUTTONS)}
        return replace(
            loop, object_size=loop.object_size if math.isnan(size) else size,
            object_frame=frame or loop.object_frame,
            names={name: loop.full_name(name) if full == f'{usual}/{name}' else full
                   for name, full in own.items()})

    def _follow(self, found: Loop) -> None:
        """Follow a loop from now on; one that is as it was goes on."""
        loop = self._as_told(found)
        if loop == self._loop:
            return
        self._loop = loop
        self._heard.close()
        for client in self._askable.values():
            self.destroy_client(client)
        self._page.set_object_size(loop.object_size)
        self._heard = HeardLoop(self, loop, self._diagnostics)
        self._askable = self._askers()

    def _askers(self) -> dict[str, Client]:
        return {label: self.create_client(Trigger, self._loop.full_name(service))
                for service, (label, _) in BUTTONS.items()}

    def _draw(self) -> None:
        self._heard.take()
        for label in self._page.clicks():
            self._askable[label].call_async(Trigger.Request()).add_done_callback(
                partial(self._on_answer, label))
        self._page.draw(self._heard.observer.state)

    def _on_answer(self, label: str, answer: Future) -> None:
        response = answer.result()
        self._page.notify(label if response.success else f'{label}: refused', response.message)

    def _tell(self) -> None:
        self._finder.look()
        words = link_words(
            self._heard.links(), self._heard.observer.state, self._heard.problems())
        if self._finder.others:
            words.append(f'There are loops in {", ".join(self._finder.others)}: choose one with '
                         f'-r __ns:={self._finder.others[0]}.')
        self._page.tell(words)
        for label, service in self._askable.items():
            self._page.enable(label, service.service_is_ready())

    def destroy_node(self) -> None:
        """Stop serving the page, and end."""
        self._page.close()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the viewer until it is asked to stop."""
    # Where cores are short, who watches gives way to the loop: less of them, and never at once
    os.nice(10)
    os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    run_node(ViewerNode, args)


if __name__ == '__main__':
    main()
