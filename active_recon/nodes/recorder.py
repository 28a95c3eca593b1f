"""ROS shell of the bag writer: what passes on the loop's topics, as the bytes that passed."""

from datetime import datetime
from functools import partial
from itertools import count
from pathlib import Path
import time

from active_recon import __version__
from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.errors import ActiveReconError, RecordingError
from active_recon.nodes.recording.disk_rate import DiskRate
from active_recon.nodes.recording.recorded_nodes import RecordedNodes
from active_recon.nodes.recording.recorded_topics import RecordedTopics
from active_recon.nodes.recording.sequence_gaps import SequenceGaps
from active_recon.nodes.runtime.definitions import message_class, message_definition
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.output import output_path
from active_recon.nodes.runtime.parameters import Parameters, ReadOnlySaysWhy
from active_recon.nodes.runtime.qos import common_profile, offered_profile
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import one_line, run_node
from active_recon.nodes.runtime.topic_names import full_names
from active_recon.parameters.recorder import DIAGNOSTICS, RecorderSettings
from msg_tools.episodes import done_from_msg
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription
from std_msgs.msg import Header
from std_srvs.srv import Trigger

MADE_IT = ('weights_sha256', 'config_sha256', 'runtime', 'needs_front', 'policy', 'seed', 'object')
"""The parameters of the loop's nodes that say what made the bag."""
WATCH_EVERY_S = 0.1
FLUSH_EVERY_S = 0.5  # so that a crash costs less than a second
# Who offers less than those before is no mistake: it is listened to anew.
ADAPTS = SubscriptionEventCallbacks(use_default_callbacks=False)
QUEUE = 1000  # messages that may wait while the disk is slow
_LAST_WORDS = 10  # looks: so long after the end of an episode, what belongs to it still comes


class RecorderNode(ReadOnlySaysWhy, QosWarnings):
    """Write the messages of each topic into an MCAP bag, with the QoS they were offered."""

    def __init__(self) -> None:
        super().__init__('recorder')
        settings = Parameters(self, RecorderSettings).now
        self._output_dir = Path(settings.output_dir)
        self._max_bytes = 1_000_000 * settings.max_bag_size_mb
        self._stop_when_done = settings.stop_when_done
        self._diagnostics = Diagnostics(self)
        self._topics = RecordedTopics(self, settings.topics, self._diagnostics)
        self._bag: BagWriter | None = None
        self._offered: dict[str, tuple[QosProfile, ...]] = {}
        self._heard: dict[str, Subscription] = {}
        self._gaps = SequenceGaps()
        self._done_for = 0
        self._nodes = RecordedNodes(self, self._on_parameters)
        self.create_service(Trigger, 'start', self._on_start)
        self.create_service(Trigger, 'stop', self._on_stop)
        self.create_timer(WATCH_EVERY_S, self._watch)
        self.create_timer(FLUSH_EVERY_S, self._flush)
        if settings.record_at_start:
            self._begin()
        self.get_logger().info('ready')

    def _begin(self) -> Path:
        """Begin a bag in a new folder named after the time."""
        now = datetime.now().strftime('%Y-%m-%d_%H-%M-%S')
        names = (now if again == 1 else f'{now}_{again}' for again in count(1))
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
        self._diagnostics.recover()
        self._diagnostics.count('recording')
        self.get_logger().info(f'recording into {folder}')
        return folder

    def _end(self) -> None:
        """
        Stop listening and complete the bag.

        Each bag listens anew, so that each begins with the latched messages.
        """
        for subscription in self._heard.values():
            self.destroy_subscription(subscription)
        self._heard.clear()
        self._offered.clear()
        self._done_for = 0
        bag, self._bag = self._bag, None
        if bag is not None:
            self._diagnostics.count('recording', -1)
            bag.close()
            self._disk.look(time.monotonic())
            self.get_logger().info(f'recorded {self._disk.megabytes:.1f} MB in '
                                   f'{self._disk.seconds:.0f} s into {bag.folder}')

    def _watch(self) -> None:
        """Listen to the publishers that have appeared, as each offers its messages."""
        if self._bag is None:
            self._nodes.wait()
            return
        published = set()
        for name in self._topics:
            publishers = self.get_publishers_info_by_topic(name)
            published |= {name} if publishers else set()
            self._gaps.published_by(name, {bytes(each.endpoint_gid) for each in publishers})
            offered = tuple(sorted(map(offered_profile, publishers), key=str))
            if publishers and self._offered.get(name) != offered:
                self._offered[name] = offered
                self._listen(name, publishers[0].topic_type, offered)
            if name != DIAGNOSTICS:  # which whole robots publish
                self._nodes.heard(publishers)
        self._topics.look(published)
        self._stop_if_done()
        self._nodes.ask()

    def _listen(self, name: str, type_name: str, offered: tuple[QosProfile, ...]) -> None:
        assert self._bag is not None
        try:
            self._bag.add_topic(name, type_name, message_definition(type_name), offered)
        except RecordingError as error:
            self._diagnostics.refuse(error)
            return
        profile = common_profile(offered, QUEUE)
        heard = self._heard.get(name)
        if heard is not None:
            if heard.qos_profile == profile:
                return
            self.destroy_subscription(heard)
        self._gaps.listened_anew(name)
        self._heard[name] = self.create_subscription(
            message_class(type_name), name, partial(self._on_message, name), profile, raw=True,
            event_callbacks=ADAPTS)

    def _on_message(self, topic: str, data: bytes, info: dict[str, int]) -> None:
        if self._bag is None:
            return
        try:
            self._bag.write(topic, data, info['received_timestamp'], info['source_timestamp'])
        except RecordingError as error:
            self._fail(error)
            return
        self._diagnostics.count('messages')
        lost = self._gaps.before(topic, info['publication_sequence_number'])
        if lost:
            self._diagnostics.count('lost', lost)
            self._diagnostics.warn(f'lost{topic}', (
                f'{topic}: expected every message that was published, {lost} were lost in '
                "transport; is the connection too slow, or the middleware's buffer too small?"))
        if self._stop_when_done and info['source_timestamp'] >= self._begun_at:
            self._hear_of_the_end(topic, data)

    def _hear_of_the_end(self, topic: str, data: bytes) -> None:
        if topic in self._topics.named('done') and self._heard[topic].msg_type is Header:
            with self._diagnostics.refusing():
                _, reason = done_from_msg(deserialize_message(data, Header))
                self._done_for = _LAST_WORDS if reason else 0

    def _stop_if_done(self) -> None:
        """End the recording when the last words have come."""
        if not self._done_for:
            return
        self._done_for -= 1
        if not self._done_for:
            self.get_logger().info('the episode is done')
            self._complete()

    def _on_parameters(self, node: str, parameters: dict[str, object]) -> None:
        if self._bag is None:
            return
        made_it = {name: str(parameters[name]) for name in MADE_IT if name in parameters
                   and node in self._nodes}
        made_it |= self._topics.learn(full_names(parameters))
        try:
            self._bag.attach_parameters(node, parameters)
            if made_it:
                self._bag.add_provenance(made_it)
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
        self._disk.look(time.monotonic())
        self._diagnostics.tell('Bag (MB)', f'{self._disk.megabytes:.1f}', at_once=False)
        self._diagnostics.tell(
            'Disk (MB/s)', f'{self._disk.megabytes_per_s:.2f}', at_once=False)

    def _complete(self) -> str:
        """End the recording; return in words what kept the bag from being whole, '' if nothing."""
        try:
            self._end()
        except RecordingError as error:
            self._fail(error)
            return one_line(error)
        return ''

    def _fail(self, error: RecordingError) -> None:
        """Say that the recording has ended by itself; the bag has closed itself already."""
        self._diagnostics.fail(error.kind, f'recording stopped: {one_line(error)}')
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
            self._diagnostics.refuse(error)
            response.message = one_line(error)
        return response

    def _on_stop(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the bag's folder, complete by then."""
        if self._bag is None:
            response.message = 'expected a recording to stop, but there is none'
            return response
        folder = self._bag.folder
        response.message = self._complete() or str(folder)
        response.success = response.message == str(folder)
        return response

    def destroy_node(self) -> None:
        """Complete the bag before the node goes."""
        self._complete()
        super().destroy_node()


def main(args: list[str] | None = None) -> None:
    """Run the recorder until it is asked to stop."""
    run_node(RecorderNode, args)


if __name__ == '__main__':
    main()
