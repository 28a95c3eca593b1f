"""ROS shell of the reconstructor: views in, the object's occupancy out; it owns the episode."""

from functools import partial
import math
from pathlib import Path
import time
import uuid

from active_recon.acquisition.view_gate import ViewGate
from active_recon.errors import DataError, MessageError
from active_recon.geometry.cameras import Camera, CANONICAL_ELEVATION, ELEVATION_TOLERANCE
from active_recon.models.weights_files import find_weights
from active_recon.nodes.camera.images import CameraImages
from active_recon.nodes.camera.monitor import CameraWatch
from active_recon.nodes.camera.pose_sources import check_pose_source, hear_poses
from active_recon.nodes.camera.reference_capture import ReferenceCapture
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.clock import STEADY
from active_recon.nodes.runtime.deferred_work import AfterHearing
from active_recon.nodes.runtime.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.runtime.output import output_path
from active_recon.nodes.runtime.parameters import Commit, Parameters, tell
from active_recon.nodes.runtime.qos import HEARD, LATCHED
from active_recon.nodes.runtime.run import one_line
from active_recon.nodes.runtime.topic_names import tell_names
from active_recon.parameters.reconstructor import ReconstructorSettings
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.volumes.voxels import PUBLISHED_FLOOR, write_mesh
from geometry_msgs.msg import PoseStamped
from msg_tools.camera_images import pixels_from_msg
from msg_tools.cameras import intrinsics_from_msg, pose_from_msg, pose_to_msg
from msg_tools.entropy import entropy_to_msg
from msg_tools.episodes import Episode, episode_to_msg
from msg_tools.goals import view_goal_from_msg
from msg_tools.images import image_to_msg, latent_to_msg, mask_from_msg
from msg_tools.stamps import nanoseconds_from_stamp, stamp_from_nanoseconds
from msg_tools.views import UnreadView, ViewJoiner
from msg_tools.voxels import voxel_grid_to_msg
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState, PointCloud2
from std_msgs.msg import Header
from std_srvs.srv import Trigger

FACTS = {'weights_sha256': 'the hash of the weights',
         'config_sha256': "the hash of the network's sizes", 'runtime': 'what runs the network',
         'needs_front': "whether the network needs the object's front"}
"""What the node tells of its network as parameters, and what they mean."""
TOPICS = ('camera/image_raw', 'camera/camera_info', 'camera/pose', 'camera/mask', 'next_view',
          'view', 'view_image', 'network_image', 'occupancy', 'probabilities', 'latent', 'entropy',
          'episode')
"""What the node hears and publishes."""


class ReconstructorNode(ManagedNode):
    """Fold the views that the gate lets through into the reconstruction and publish it."""

    def __init__(self) -> None:
        super().__init__('reconstructor')
        self._settings = Parameters(self, ReconstructorSettings)
        self._settings.on_change(self._change)
        self._capture = ReferenceCapture(self)

    def configure(self) -> None:
        """Load the network, and offer what comes of it."""
        settings = self._settings.now
        self._background = settings.as_background()
        self.on_undo(self._capture.forget)
        tell_names(self, TOPICS)
        check_pose_source(settings)
        self._reconstructor = self._load(settings)
        self._joiner = ViewJoiner(settings.max_pose_gap, masks=self._background.how == 'mask')
        self._gate = ViewGate(
            settings.take_views, settings.goal_tolerance, settings.min_view_separation,
            settings.settle_time)
        self._watch = CameraWatch(
            self._diagnostics, settings.goal_tolerance, settings.stall_timeout)
        self._object_frame = settings.object_frame
        self._reconstruction: Reconstruction | None = None
        self._view_pub = self.create_publisher(PoseStamped, 'view', LATCHED)
        self._view_image_pub = self.create_publisher(Image, 'view_image', LATCHED)
        self._network_image_pub = self.create_publisher(Image, 'network_image', LATCHED)
        self._occupancy_pub = self.create_publisher(PointCloud2, 'occupancy', LATCHED)
        self._probabilities_pub = self.create_publisher(PointCloud2, 'probabilities', LATCHED)
        self._latent_pub = self.create_publisher(Image, 'latent', LATCHED)
        self._entropy_pub = self.create_publisher(JointState, 'entropy', LATCHED)
        self._episode_pub = self.create_publisher(Header, 'episode', LATCHED)
        self._diagnostics.measure('images', 'poses', 'views')
        for fact, name in (('weights_sha256', 'Weights SHA-256'), ('runtime', 'Runtime')):
            self._diagnostics.tell(name, self._reconstructor.provenance.get(fact, ''))
        self.create_service(Trigger, 'start_episode', self._on_start)
        self.create_service(Trigger, 'save_mesh', self._on_save)

    def activate(self) -> None:
        """Begin an episode, and hear the camera."""
        self._begin_episode()
        self._later = AfterHearing(self, self._fold_waiting)
        self.on_undo(self._later.close)
        inputs = AwaitedInputs(self, self._diagnostics)
        self.on_undo(inputs.forget)
        inputs.hear(CameraInfo, 'camera/camera_info', self._on_camera_info, HEARD)
        if self._background.how == 'mask':
            inputs.hear(Image, 'camera/mask', self._on_mask, HEARD)
        self._poses = hear_poses(self, self._settings.now, self._object_frame, self._on_pose,
                                 self._diagnostics, inputs)
        self._goals = self.create_subscription(PoseStamped, 'next_view', self._on_goal, HEARD)
        # Last: whoever is found by an image has been found by what belongs to it
        CameraImages(self, self._diagnostics, inputs, self._on_image, self._watch.lost)
        # What has waited in vain is refused
        self.create_timer(0.1, self._take_in, clock=STEADY)
        self.create_timer(0.1, self._watch.tell, clock=STEADY)
        self.on_undo(self._watch.forget)

    def _load(self, settings: ReconstructorSettings) -> Reconstructor:
        """Load the network and run it once, so that the first view is as fast as the others."""
        # One thread by default: with more, the slowest of the loop's busy cores is waited for
        reconstructor = Reconstructor.load(
            find_weights(settings.weights or None), settings.device, settings.object_size,
            settings.object_yaw, _given(settings.threshold), settings.threads)
        for fact, meaning in FACTS.items():
            tell(self, fact, reconstructor.provenance.get(fact, ''), meaning)
        reconstructor.warm_up()
        return reconstructor

    def _change(self, settings: ReconstructorSettings) -> Commit | None:
        """Return what puts settings into effect that changed while the node runs."""
        background = settings.as_background()
        if not self.is_configured:
            return None

        def commit() -> None:
            self._background = background
            self._reconstructor.set_threshold(_given(settings.threshold))
            self._joiner.max_pose_gap = settings.max_pose_gap
            self._gate.take_views = settings.take_views
            self._gate.goal_tolerance = settings.goal_tolerance
            self._gate.min_view_separation = settings.min_view_separation
            self._watch.change(settings.goal_tolerance, settings.stall_timeout)
            self._gate.settle_time = settings.settle_time

        return commit

    def _begin_episode(self) -> None:
        self._waiting: UnreadView | None = None
        self._reconstructor.reset()
        self._gate.reset()
        self._reconstruction = None
        self._episode = Episode(uuid.uuid4().hex[:12], self.get_clock().now().nanoseconds)
        self._joiner.clear(self._episode.begin)
        self._diagnostics.count('episodes')
        self._diagnostics.tell('Episode', self._episode.id)
        self._diagnostics.tell('Views of the episode', '0')
        self._episode_pub.publish(episode_to_msg(self._episode))

    def clock_went_back(self, how: str) -> None:
        """Begin an episode: what was seen bears stamps that are yet to come."""
        self._begin_episode()
        self._diagnostics.count('clock_jumps')
        self.get_logger().warning(f'{how}: the episode {self._episode.id} begins')

    def _on_image(self, msg: Image | CompressedImage) -> None:
        self._diagnostics.count('images')
        with self._diagnostics.refusing():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._watch.heard('images', stamp)
            self._capture.image_came(stamp, partial(pixels_from_msg, msg))
            if stamp < self._episode.begin or self.clock_watch.is_ahead(stamp):
                raise MessageError(
                    'expected an image of this episode, which began at '
                    f'{self._episode.begin / 1e9:.3f} s, got one of {stamp / 1e9:.3f} s; for a '
                    'recording, play its clock and set use_sim_time', 'last_episode')
            self._joiner.add_image(stamp, msg, time.monotonic())
            self._poses.image_came(msg.header)
        self._heard()

    def _on_camera_info(self, msg: CameraInfo) -> None:
        with self._diagnostics.refusing():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._watch.heard('camera_info', stamp)
            self._joiner.add_intrinsics(stamp, intrinsics_from_msg(msg))
        self._heard()

    def _on_mask(self, msg: Image) -> None:
        self._joiner.add_mask(nanoseconds_from_stamp(msg.header.stamp), msg)
        self._heard()

    def _on_pose(self, msg: PoseStamped) -> None:
        self._diagnostics.count('poses')
        with self._diagnostics.refusing():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            self._watch.heard('poses', stamp)
            pose = pose_from_msg(msg, self._object_frame)
            self._watch.stands(Camera(pose), stamp, self._gate.open_goal)
            self._joiner.add_pose(stamp, pose)
        self._heard()

    def _on_goal(self, msg: PoseStamped) -> None:
        with self._diagnostics.refusing():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if stamp >= self._episode.begin and not self.clock_watch.is_ahead(stamp):
                self._fold_waiting()  # it was taken for the goal before
                self._gate.set_goal(view_goal_from_msg(msg, self._object_frame), stamp)

    def _heard(self) -> None:
        """Take in what came of the camera."""
        self._later.heard()
        self._take_in()

    def _take_in(self) -> None:
        """Look through what is joined by now for what is to be a view: the newest is folded in."""
        for view in self._joiner.joined(time.monotonic()):
            if isinstance(view, MessageError):
                self._diagnostics.refuse(view)
            elif not self._gate.wants(view.camera, view.stamp,
                                      self.count_publishers(self._goals.topic_name) > 0):
                self._diagnostics.count('images_unused')
            else:
                if self._waiting is not None:
                    self._diagnostics.count('dropped/overtaken')
                self._waiting = view
                self._later.ask()

    def _fold_waiting(self) -> None:
        view, self._waiting = self._waiting, None
        if view is not None:
            with self._diagnostics.refusing():
                self._fold(view)

    def _fold(self, unread: UnreadView) -> None:
        view = unread.read()
        mask = None if view.mask is None else mask_from_msg(view.mask)
        image = self._background.cleared(view.image, mask, self._capture.reference)
        reconstruction = self._reconstructor.add_view(image, view.camera)
        self._gate.took(view.camera)
        self._warn_of(view.camera)
        self._reconstruction = reconstruction
        self._diagnostics.count('views')
        grid = reconstruction.grid
        header = Header(stamp=stamp_from_nanoseconds(view.stamp), frame_id=self._object_frame)
        self._occupancy_pub.publish(
            voxel_grid_to_msg(grid, self._reconstructor.threshold, header))
        self._diagnostics.took_since(view.stamp)
        self._diagnostics.tell('Views of the episode', str(self._reconstructor.view_count),
                               at_once=False)
        self._latent_pub.publish(latent_to_msg(reconstruction.latent, header))
        if image is not view.image:
            self._view_image_pub.publish(image_to_msg(image, header))
        if reconstruction.image is not None:
            self._network_image_pub.publish(image_to_msg(reconstruction.image[..., :3], header))
        self._view_pub.publish(pose_to_msg(view.camera.pose, header))
        self._probabilities_pub.publish(voxel_grid_to_msg(grid, PUBLISHED_FLOOR, header))
        self._entropy_pub.publish(entropy_to_msg(grid.entropy(), header))

    def _warn_of(self, camera: Camera) -> None:
        away = camera.elevation - CANONICAL_ELEVATION
        if self._reconstructor.spec.needs_front and abs(away) > ELEVATION_TOLERANCE:
            self._diagnostics.warn('elevation', (
                'expected views from an elevation of 30 degrees, as the network was trained with, '
                f'got {math.degrees(camera.elevation):.1f}; the reconstruction will be worse'))

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the new episode's id."""
        if not self.is_active:
            response.message = 'expected an active node to begin an episode; this one is inactive'
            return response
        self._begin_episode()
        response.success = True
        response.message = self._episode.id
        return response

    def _on_save(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the path of the mesh."""
        if self._reconstruction is None:
            response.message = 'expected a view before a mesh; this episode has none yet'
            return response
        settings = self._settings.now
        name = f'{self._episode.id}-{self._reconstructor.view_count}.{settings.mesh_format}'
        path = output_path(Path(settings.output_dir), name)
        try:
            write_mesh(self._reconstruction.grid.mesh(self._reconstructor.threshold), path)
        except (DataError, OSError) as error:
            response.message = f'{path} was not written: {one_line(error)}'
        else:
            response.success = True
            response.message = str(path)
        return response


def _given(value: float) -> float | None:
    """Return a parameter's value, None where it was not given."""
    return None if math.isnan(value) else value


def main(args: list[str] | None = None) -> None:
    """Run the reconstructor until it is asked to stop."""
    run_managed_node(ReconstructorNode, args)


if __name__ == '__main__':
    main()
