"""The running loop, which views it took, and what came of each, against views listed by hand."""

import signal

from active_recon.models.weights_files import find_weights, PAPER_MODEL
from active_recon.reconstructor import Reconstructor
from geometry_msgs.msg import PoseStamped
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.voxels import voxel_grid_to_msg
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header

from .conftest import LATCHED_QOS

# Of the 24 views, 15 degrees apart, those nearest to 0, 18, 36, ... 342 degrees
DEGREES = [0, 15, 30, 60, 75, 90, 105, 120, 150, 165,
           180, 195, 210, 240, 255, 270, 285, 300, 330, 345]
TOLD_S, RECOVERED_S = 3.0, 6.0
"""Seconds in which a fault is told and the loop goes on after it: 1 and 2, slow machines apart."""


def computed(shown, degrees):
    """
    Return the occupancy after each of those views, as a message without a stamp.

    By the paper's network, which sees images alone: bits do not hang on those of the poses.
    """
    reconstructor = Reconstructor.load(find_weights(PAPER_MODEL))
    grids = [reconstructor.add_view(shown.images[at // 15], shown.cameras[at // 15]).grid
             for at in degrees]
    return [voxel_grid_to_msg(grid, reconstructor.threshold, Header()) for grid in grids]


def stamp_of(msg):
    return nanoseconds_from_stamp(getattr(msg, 'header', msg).stamp)


class Loop:
    """The running loop, what is heard of it, and the faults of its camera."""

    def __init__(self, bench, nodes, shown):
        self.bench, self.nodes = bench, nodes
        self._degrees = {image.tobytes(): 15 * index for index, image in enumerate(shown.images)}
        self._seen = {}
        bench.node.create_subscription(Image, 'camera/image_raw', self._on_image, 400)
        self._views = bench.subscribe(PoseStamped, 'view')
        self._occupancy = bench.subscribe(PointCloud2, 'occupancy')
        self._episodes = bench.subscribe(Header, 'episode', LATCHED_QOS)
        self._ends = bench.subscribe(Header, 'done', LATCHED_QOS)
        self._goals = bench.subscribe(PoseStamped, 'next_view', LATCHED_QOS)
        self._clients = {
            name: bench.node.create_client(SetParameters, f'{name}/set_parameters')
            for name in nodes}
        for topic in ('camera/image_raw', 'view', 'occupancy', 'episode', 'done', 'next_view'):
            bench.until(lambda topic=topic: bench.node.count_publishers(topic), topic)

    def _on_image(self, msg):
        degrees = self._degrees.get(bytes(msg.data))
        if degrees is not None:
            self._seen[stamp_of(msg)] = degrees

    @property
    def episode(self):
        """The id of the episode."""
        return self._episodes[-1].frame_id

    @property
    def goal(self):
        """The stamp of the goal, which is its identity."""
        return stamp_of(self._goals[-1])

    def kill(self, name):
        """End a node before it knows."""
        self.nodes[name].stop(signal.SIGKILL)

    def set_faults(self, *entries):
        """Have these faults, and no others, from now on; return whether they were taken."""
        return self.set('turntable_camera', Parameter(
            'faults', Parameter.Type.STRING_ARRAY, list(entries)))

    def set(self, node, parameter):
        """Change a parameter of a node; return whether it was changed, and why not."""
        client = self._clients[node]
        request = SetParameters.Request(parameters=[parameter.to_parameter_msg()])
        self.bench.until(client.service_is_ready, f'the parameters of {node}')
        answer = client.call_async(request)
        self.bench.until(answer.done, f'the answer to {parameter.name}')
        return answer.result().results[0]

    def begin(self):
        """Begin an episode."""
        answer = self.bench.call('start_episode')
        assert answer.success
        self.bench.until(lambda: self._episodes and self.episode == answer.message,
                         'the new episode')

    def _of_episode(self, heard):
        return [msg for msg in heard if stamp_of(msg) >= stamp_of(self._episodes[-1])]

    @property
    def taken(self):
        """The degrees of the views of this episode, as their images show them."""
        return [self._seen.get(stamp_of(view)) for view in self._of_episode(self._views)]

    def count(self, key):
        return self.bench.counts('reconstructor').get(key, 0)

    def wait_views(self, number, budget_s=30.0):
        self.bench.until(lambda: len(self._of_episode(self._views)) >= number,
                         f'view {number} of an episode with {self.taken}', budget_s)

    def wait_told(self, key, before):
        self.bench.until(lambda: self.count(key) > before, f'{key} to be told', TOLD_S)

    def wait_done(self):
        def last_heard():
            ends = [msg for msg in self._of_episode(self._ends) if msg.frame_id == 'max_views']
            return ends and all(  # the end may overtake what it is the end of
                stamp_of(ends[-1]) in map(stamp_of, heard)
                for heard in (self._views, self._occupancy))

        self.bench.until(last_heard, f'the end of an episode with {self.taken}')

    def check(self, degrees, expected):
        """Wait for the end: these views, in this order, and each one's occupancy to the bit."""
        self.wait_done()
        stamps = [stamp_of(view) for view in self._of_episode(self._views)]
        clouds = {stamp_of(cloud): cloud for cloud in self._of_episode(self._occupancy)}
        self.bench.until(lambda: set(stamps) <= self._seen.keys(), 'the images of all views')
        assert self.taken == degrees
        assert sorted(clouds) == stamps
        for stamp, cloud in zip(stamps, expected, strict=True):
            assert clouds[stamp].data == cloud.data
        assert all(node.running for node in self.nodes.values())
        assert not [line for node in self.nodes.values() for line in node.log('Traceback|ERROR')]
