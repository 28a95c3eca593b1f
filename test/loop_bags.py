"""Recordings of a small loop, made without the loop: what its nodes would have published."""

from dataclasses import dataclass, field

from active_recon.bags.storage.writer import BagWriter
from active_recon.geometry.cameras import CANONICAL_INTRINSICS, orbit_camera
from active_recon.volumes.voxels import PUBLISHED_FLOOR, VoxelGrid
from msg_tools.cameras import camera_to_msgs, pose_to_msg
from msg_tools.diagnostics import diagnostics_to_msg, NodeStatus
from msg_tools.entropy import entropy_to_msg
from msg_tools.episodes import done_to_msg, Episode, episode_to_msg
from msg_tools.goals import scores_to_msg, view_goal_to_msg
from msg_tools.images import image_to_msg, latent_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from msg_tools.voxels import voxel_grid_to_msg
import numpy as np
from rclpy.serialization import serialize_message
from recorded_messages import cdr, definition, LATCHED, SENSOR
from std_msgs.msg import Header

BEGIN = 1_700_000_000_000_000_000
PERIOD = 100_000_000  # ns, of the camera
STILL = 3  # images of a camera that stands, of which the last becomes the view
DELAY = 2_000_000  # ns, until a message is received
LENS = CANONICAL_INTRINSICS.resized(16, 16)


@dataclass
class LoopRun:
    """Three views of one object, and the messages that tell of them: (time, topic, message)."""

    id: str = 'first'
    begin: int = BEGIN
    azimuths: tuple[float, ...] = (0.0, 2.0, 4.0)
    resolution: int = 32
    threshold: float = 0.5
    messages: list = field(default_factory=list)
    stamps: list = field(default_factory=list)

    def __post_init__(self):
        rng = np.random.default_rng(self.begin % 1000 + len(self.id))
        count = len(self.azimuths)
        self.images = rng.integers(0, 256, (count, 16, 16, 3), np.uint8)
        cells = (self.resolution,) * 3
        self.grids = [VoxelGrid(np.float32(rng.random(cells) * (rng.random(cells) < 0.03)))
                      for _ in range(count)]
        self.latents = rng.normal(size=(count, 6, 4, 4)).astype(np.float32)
        self.candidates = [orbit_camera(azimuth, 0.5) for azimuth in np.arange(24) * np.pi / 12]
        self.scores = rng.normal(size=(count, 24)).astype(np.float32)
        self.goal_stamps = []
        self._say(self.begin, '/episode', episode_to_msg(Episode(self.id, self.begin)))
        self._say(self.begin + 1, '/done', done_to_msg(self.begin, ''))
        now = self.begin + 2
        for number in range(count):
            now = self._view(number, now)
        self._say(now, '/done', done_to_msg(self.stamps[-1], 'max_views'))
        self._say(now + 1, '/diagnostics', diagnostics_to_msg(
            NodeStatus('/reconstructor', {'views': count}), stamp_from_nanoseconds(now)))
        self.end = now + PERIOD

    def _say(self, time, topic, msg):
        self.messages.append((time, topic, msg))

    def _view(self, number, now):
        """Publish a goal, the camera at rest, and what came of its last image."""
        azimuth = self.azimuths[number]
        self.goal_stamps.append(now)
        goal = header(now, 'object')
        self._say(now, '/azimuth_scores', scores_to_msg(
            self.candidates, self.scores[number], goal))
        for repeat in range(2):
            self._say(now + 10 + repeat * PERIOD, '/next_view',
                      view_goal_to_msg(orbit_camera(azimuth, 0.5), goal))
        camera = orbit_camera(azimuth, intrinsics=LENS)
        for _ in range(STILL):
            now += PERIOD
            stamped = header(now, 'camera')
            info, pose = camera_to_msgs(camera, stamped)
            self._say(now + 1, '/camera/pose', pose)
            self._say(now + 2, '/camera/camera_info', info)
            self._say(now + 3, '/camera/image_raw', image_to_msg(self.images[number], stamped))
        self.stamps.append(now)
        stamped, grid = header(now, 'object'), self.grids[number]
        self._say(now + 1_000_000, '/occupancy', voxel_grid_to_msg(
            grid, self.threshold, stamped))
        self._say(now + 1_000_001, '/latent', latent_to_msg(self.latents[number], stamped))
        self._say(now + 1_000_002, '/view', pose_to_msg(camera.pose, stamped))
        self._say(now + 1_000_003, '/probabilities', voxel_grid_to_msg(
            grid, PUBLISHED_FLOOR, stamped))
        self._say(now + 1_000_004, '/entropy', entropy_to_msg(grid.entropy(), stamped))
        return now + 2_000_000


def header(stamp, frame):
    return Header(stamp=stamp_from_nanoseconds(stamp), frame_id=frame)


def type_name(msg):
    if hasattr(msg, '__msgtype__'):  # of rosbags: one that the ROS of wheels does not have
        return msg.__msgtype__
    return f'{type(msg).__module__.split(".")[0]}/msg/{type(msg).__name__}'


def message_data(msg):
    return cdr(msg) if hasattr(msg, '__msgtype__') else serialize_message(msg)


def write_bag(folder, messages, max_bytes=None, parameters=None, one_by_one=False,
              others=()):
    """
    Write (time, topic, message) into a bag, and return its folder.

    `parameters` are those of the reconstructor, `others` nodes whose parameters it has, too.
    Within a chunk the writer sorts by time, unless each message has one of its own.
    """
    with BagWriter(folder, max_bytes) as bag:
        if parameters:
            bag.attach_parameters('/reconstructor', parameters)
        for name in others:
            bag.attach_parameters(name, {})
        for time, topic, msg in messages:
            bag.add_topic(topic, type_name(msg), definition(type_name(msg)),
                          (SENSOR if topic.startswith('/camera/') else LATCHED,))
            bag.write(topic, message_data(msg), time + DELAY, time)
            if max_bytes or one_by_one:
                bag.flush()  # a file may end wherever a chunk does
    return folder
