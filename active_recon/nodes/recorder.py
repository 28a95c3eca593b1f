"""ROS node that records the loop's topics into a bag, as serialized messages."""

from datetime import datetime
from itertools import count
from pathlib import Path
import time

from active_recon import __version__
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import ActiveReconError, RecordingError
from active_recon.nodes.recording.disk_rate import DiskRate
from active_recon.nodes.recording.recorded_nodes import RecordedNodes
from active_recon.nodes.recording.recorded_subscriptions import RecordedSubscriptions
from active_recon.nodes.recording.recorded_topics import RecordedTopics
from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.output import output_path
from active_recon.nodes.runtime.parameters import Parameters
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import one_line, run_node
from active_recon.nodes.runtime.topic_names import full_names
from active_recon.parameters.recorder import DIAGNOSTICS, RecorderParameters
from msg_tools.episodes import done_from_msg
from rclpy.serialization import deserialize_message
from std_msgs.msg import Header
from std_srvs.srv import Trigger

PROVENANCE = {'weights_sha256': 'weights_sha256', 'config_sha256': 'config_sha256',
              'computed_by': 'computed_by', 'needs_front': 'needs_front',
              'policy': 'policy_in_use', 'seed': 'seed', 'object': 'object'}
"""The bag's provenance: its names, and those of the parameters of the loop's nodes."""
UPDATE_EVERY_S = 0.1
FLUSH_EVERY_S = 0.5  # so that a crash costs less than a second
_UPDATES_AFTER_DONE = 10  # for the episode's last messages to arrive


class RecorderNode(QosWarnings):
    """Write the messages of each topic into an MCAP bag, with the QoS of their publishers."""

    def __init__(self) -> None:
        super().__init__('recorder')
        params = Parameters(self, RecorderParameters).values
        self._output_dir = Path(params.output_dir)
        self._max_bytes = 1_000_000 * params.max_bag_size_mb
        self._stop_when_done = params.stop_when_done
        self._diagnostics = Diagnostics(self)
        self._topics = RecordedTopics(self, params.topics, self._diagnostics)
        self._bag: BagWriter | None = None
        self._inputs = RecordedSubscriptions(self, self._on_message)
        self._updates_left = 0
        self._nodes = RecordedNodes(self, self._on_parameters)
        self.create_service(Trigger, 'start', self._on_start)
        self.create_service(Trigger, 'stop', self._on_stop)
        self.create_timer(UPDATE_EVERY_S, self._update, clock=STEADY)
        self.create_timer(FLUSH_EVERY_S, self._flush, clock=STEADY)
        if params.record_at_start:
            self._begin()
        self.get_logger().info('ready')

    def _begin(self) -> Path:
        """Begin a bag in a new folder, named by the time."""
        now = datetime.now().strftime('%Y-%m-%d_%H-%M-%S')
        names = (now if number == 1 else f'{now}_{number}' for number in count(1))
        folder = next(path for name in names
                      if not (path := output_path(self._output_dir, name)).exists())
        bag = BagWriter(folder, self._max_bytes)
        bag.add_provenance({'version': __version__})
        own = self.get_parameters(list(self.get_parameters_by_prefix('')))
        bag.attach_parameters(
            self.get_fully_qualified_name(), {each.name: each.value for each in own})
        self._bag = bag
        self._begun_at = time.time_ns()
        self._disk = DiskRate(folder, time.monotonic())
        self._topics.begin()
        self._nodes.forget()
        self._diagnostics.clear_error()
        self._diagnostics.count('recording')
        self.get_logger().info(f'recording into {folder}')
        return folder

    def _end(self) -> None:
        """
        Unsubscribe and complete the bag.

        The next bag subscribes again, so that it begins with the latched messages.
        """
        self._inputs.clear()
        self._updates_left = 0
        bag, self._bag = self._bag, None
        if bag is not None:
            self._diagnostics.count('recording', -1)
            bag.close()
            self._disk.update(time.monotonic())
            self.get_logger().info(f'recorded {self._disk.megabytes:.1f} MB in '
                                   f'{self._disk.seconds:.0f} s into {bag.folder}')

    def _update(self) -> None:
        """Subscribe to the topics that have new publishers."""
        if self._bag is None:
            self._nodes.pause()
            return
        published = set()
        for name in self._topics:
            publishers = self.get_publishers_info_by_topic(name)
            published |= {name} if publishers else set()
            with self._diagnostics.rejecting():
                self._inputs.update(name, publishers, self._bag)
            if name != DIAGNOSTICS:  # which every node of a robot publishes
                self._nodes.add_publishers(publishers)
        self._topics.update(published)
        self._stop_if_done()
        self._nodes.update()

    def _on_message(self, topic: str, data: bytes, info: dict[str, int]) -> None:
        if self._bag is None:
            return
        try:
            self._bag.write(topic, data, info['received_timestamp'], info['source_timestamp'])
        except RecordingError as error:
            self._fail(error)
            return
        self._diagnostics.count('messages')
        lost = self._inputs.lost_before(topic, info['publication_sequence_number'])
        if lost:
            self._diagnostics.count('lost', lost)
            self._diagnostics.warn(f'lost{topic}', (
                f'{topic}: messages lost: expected every one that was published, {lost} were '
                'lost in transport; is the connection too slow, or the '
                "middleware's buffer too small?"))
        if info['source_timestamp'] >= self._begun_at:
            self._check_done(topic, data)

    def _check_done(self, topic: str, data: bytes) -> None:
        if topic in self._topics.named('done') and self._inputs.message_type(topic) is Header:
            with self._diagnostics.rejecting():
                _, reason = done_from_msg(deserialize_message(data, Header))
                if self._stop_when_done:
                    self._updates_left = _UPDATES_AFTER_DONE if reason else 0
                elif reason:
                    self.get_logger().info(
                        'the episode is done; the recording goes on with '
                        f'{self._disk.megabytes_per_s:.1f} MB/s until `stop` is called; '
                        'stop_when_done:=true ends it with the episode')

    def _stop_if_done(self) -> None:
        """End the recording some time after the episode is done."""
        if not self._updates_left:
            return
        self._updates_left -= 1
        if not self._updates_left:
            self.get_logger().info('the episode is done')
            self._complete()

    def _on_parameters(self, node: str, parameters: dict[str, object]) -> None:
        if self._bag is None:
            return
        provenance = {name: str(parameters[parameter]) for name, parameter in PROVENANCE.items()
                      if parameter in parameters and node in self._nodes}
        provenance |= self._topics.add_names(full_names(parameters))
        try:
            self._bag.attach_parameters(node, parameters)
            if provenance:
                self._bag.add_provenance(provenance)
        except RecordingError as error:
            self._fail(error)

    def _flush(self) -> None:
        if self._bag is None:
            return
        try:
            self._bag.flush()
        except RecordingError as error:
            self._fail(error)
            return
        self._disk.update(time.monotonic())
        self._diagnostics.set_value('Bag (MB)', f'{self._disk.megabytes:.1f}', at_once=False)
        self._diagnostics.set_value(
            'Disk (MB/s)', f'{self._disk.megabytes_per_s:.2f}', at_once=False)

    def _complete(self) -> str:
        """End the recording; return why the bag is not complete, '' if it is."""
        try:
            self._end()
        except RecordingError as error:
            self._fail(error)
            return one_line(error)
        return ''

    def _fail(self, error: RecordingError) -> None:
        """Report that the recording has ended with an error; the bag is closed already."""
        self._diagnostics.raise_error(error.kind, f'recording stopped: {one_line(error)}')
        self._end()

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the bag's folder."""
        if self._bag is not None:
            response.message = f'already recording into {self._bag.folder}'
            return response
        try:
            response.message = str(self._begin())
            response.success = True
        except ActiveReconError as error:
            self._diagnostics.reject(error)
            response.message = one_line(error)
        return response

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the folder of the complete bag."""
        if self._bag is None:
            response.message = 'no recording to stop: expected a running one, there is none'
            return response
        folder = self._bag.folder
        response.message = self._complete() or str(folder)
        response.success = response.message == str(folder)
        return response

    def destroy_node(self) -> None:
        """Complete the bag before the node is destroyed."""
        self._complete()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the recorder until it is asked to stop."""
    run_node(RecorderNode, args)


if __name__ == '__main__':
    main()
