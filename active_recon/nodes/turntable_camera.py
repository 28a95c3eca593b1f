"""ROS node of the simulated turntable: a camera stream of an object that turns."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from active_recon.datasets.layout import list_objects
from active_recon.errors import DataError
from active_recon.nodes.runtime.clock import ClockMonitor, STEADY
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.parameters import Commit, Parameters, set_read_only_parameter
from active_recon.nodes.runtime.qos import SENSOR_QOS, STREAM_QOS
from active_recon.nodes.runtime.qos_warnings import QosWarnings
from active_recon.nodes.runtime.run import one_line, run_node
from active_recon.objects import find_object
from active_recon.parameters.turntable_camera import TurntableCameraParameters
from active_recon.simulation.faults import CameraFaults, read_faults, Sent, Shot
from active_recon.simulation.orbit import Orbit
from active_recon.simulation.shown_object import (
    object_anywhere,
    rendered_object,
    Shown,
    stored_object,
)
from geometry_msgs.msg import PoseStamped
from msg_tools.cameras import camera_to_msgs
from msg_tools.goals import azimuth_goal_from_msg, view_goal_from_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.task import Future
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger

ANSWER_S = 2.0
"""Time to wait for the reconstructor to begin an episode."""
_OBJECT = 'name of the object that is shown'


class TurntableCameraNode(QosWarnings):
    """Publish images, camera info and poses, also while the turntable turns to a goal."""

    def __init__(self) -> None:
        super().__init__('turntable_camera')
        self._params = Parameters(self, TurntableCameraParameters)
        self._params.on_change(self._change)
        params = self._params.values
        self._motion = _at_start(params)
        self._faults = CameraFaults(read_faults(params.faults), params.faults_seed)
        self._objects = _objects(params)
        self._index = 0
        first = self._objects[0]()
        self._shown: Shown | None = first
        set_read_only_parameter(self, 'object', first.name, _OBJECT)
        self._diagnostics = Diagnostics(self)
        self._info_pub = self.create_publisher(CameraInfo, 'camera/camera_info', STREAM_QOS)
        self._pose_pub = self.create_publisher(PoseStamped, 'camera/pose', STREAM_QOS)
        # Last: who discovers the images has discovered what belongs to them
        self._image_pub = self.create_publisher(Image, 'camera/image_raw', STREAM_QOS)
        if params.follows == 'view':
            self.create_subscription(PoseStamped, 'next_view', self._on_view_goal, SENSOR_QOS)
        else:
            self.create_subscription(JointState, 'next_azimuth', self._on_goal, SENSOR_QOS)
        self._start_episode = self.create_client(Trigger, 'start_episode')
        # In a group of its own: the answer must arrive while the service waits for it.
        self.create_service(Trigger, 'next_object', self._on_next_object,
                            callback_group=MutuallyExclusiveCallbackGroup())
        self._timer = self.create_timer(1 / params.rate, self._show)
        self._clock_monitor = ClockMonitor(self, self._clock_went_back)
        self.get_logger().info('ready')

    def _change(self, params: TurntableCameraParameters) -> Commit:
        """Return a function that applies a change of parameters."""
        faults = read_faults(params.faults)

        def commit() -> None:
            self._motion.set_speed(params.speed, params.time_scale, self._motor_s())
            self._faults.change(faults)
            self._timer.timer_period_ns = round(1e9 / params.rate)
            self._timer.reset()

        return commit

    def _clock_went_back(self, how: str) -> None:
        self._motion = _at_start(self._params.values)
        self.get_logger().warning(f'{how}: the turntable is back at its start')

    def _now_s(self) -> float:
        return self.get_clock().now().nanoseconds / 1e9

    def _motor_s(self) -> float:
        return self._faults.motor_time(self._now_s())

    def _show(self) -> None:
        if self._shown is None:
            return
        now = self.get_clock().now().nanoseconds
        if not self._faults.is_there(now / 1e9):
            self._motion = _at_start(self._params.values)
            return
        azimuth, elevation = self._motion.at(self._faults.motor_time(now / 1e9))
        image, camera = self._shown.seen_from(
            azimuth, elevation if self._params.values.follows == 'view' else None)
        # The image is last: by then its camera info and pose have been published.
        for sent in self._faults.sent(Shot(now, image, camera), now / 1e9):
            self._send(sent)

    def _send(self, sent: Sent) -> None:
        params, shot = self._params.values, sent.shot
        header = Header(stamp=stamp_from_nanoseconds(shot.stamp), frame_id=params.camera_frame)
        if sent.part == 'image':
            msg = image_to_msg(shot.image, header)
            del msg.data[round(sent.kept * len(msg.data)):]
            self._image_pub.publish(msg)
            self._diagnostics.count('images')
            return
        info, pose = camera_to_msgs(shot.camera, header, params.object_frame)
        if sent.part == 'pose':
            self._pose_pub.publish(pose)
        else:
            self._info_pub.publish(info)

    def _on_goal(self, msg: JointState) -> None:
        if not self._faults.is_there(self._now_s()):
            return
        with self._diagnostics.rejecting():
            self._motion.turn_to(azimuth_goal_from_msg(msg), self._motor_s())
            self._diagnostics.count('goals')

    def _on_view_goal(self, msg: PoseStamped) -> None:
        if not self._faults.is_there(self._now_s()):
            return
        with self._diagnostics.rejecting():
            goal = view_goal_from_msg(msg, self._params.values.object_frame)
            self._motion.go_to(goal, self._motor_s())
            self._diagnostics.count('goals')

    async def _on_next_object(self, _request: Trigger.Request,
                              response: Trigger.Response) -> Trigger.Response:
        """Begin an episode, then show the next object; after the last comes the first."""
        index = (self._index + 1) % len(self._objects)
        try:
            following = self._objects[index]()
        except DataError as error:
            self._diagnostics.reject(error)
            response.message = one_line(error)
            return response
        shown, self._shown = self._shown, None  # no image of the old object in the new episode
        refusal = await self._begin_episode()
        if refusal:
            self._shown = shown
            response.message = ('no new episode: expected the reconstructor to begin one, but it '
                                f'{refusal}; the object is still the same')
            return response
        self._index, self._shown = index, following
        set_read_only_parameter(self, 'object', following.name, _OBJECT)
        response.success = True
        response.message = f'{following.name} ({index + 1} of {len(self._objects)})'
        return response

    async def _begin_episode(self) -> str:
        """Request a new episode of the reconstructor; return why it did not begin one, or ''."""
        answered = Future()
        late = self.create_timer(
            ANSWER_S, lambda: answered.done() or answered.set_result(None), clock=STEADY)
        request = self._start_episode.call_async(Trigger.Request())
        request.add_done_callback(
            lambda call: answered.done() or answered.set_result(call.result()))
        answer = await answered
        self.destroy_timer(late)
        if answer is None:
            return f'did not answer within {ANSWER_S:g} s'
        return '' if answer.success else f'answered: {answer.message}'


def _at_start(params: TurntableCameraParameters) -> Orbit:
    return Orbit(params.start_azimuth, speed=params.speed, time_scale=params.time_scale)


def _objects(params: TurntableCameraParameters) -> Sequence[Callable[[], Shown]]:
    """Return functions that load each object: only one is in memory at a time."""
    size, background = params.object_size, params.background
    if params.mesh:
        made = object_anywhere if params.follows == 'view' else rendered_object
        return [partial(made, find_object(params.mesh), size, background,
                        params.up or None, params.front or None)]
    folders = list_objects(Path(params.dataset))
    if not folders:
        raise DataError(f'{params.dataset}: no objects: expected a dataset with some, got none')
    return [partial(stored_object, folder, size, background) for folder in folders]


def main(args: list[str] | None = None) -> None:
    """Run the simulated turntable until it is asked to stop."""
    run_node(TurntableCameraNode, args)


if __name__ == '__main__':
    main()
