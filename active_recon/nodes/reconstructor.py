"""ROS node of the reconstructor: views in, the object's occupancy out; it owns the episode."""

from contextlib import nullcontext
from functools import partial
import math
from pathlib import Path
import uuid

from active_recon.acquisition.view_gate import ViewGate
from active_recon.errors import DataError, MessageError
from active_recon.freed_memory import give_back_freed_memory
from active_recon.geometry.cameras import Camera
from active_recon.models.weights_files import find_weights
from active_recon.nodes.camera.depth_images import DEPTH_INFO_TOPIC, DEPTH_TOPIC
from active_recon.nodes.camera.pose_sources import check_pose_source
from active_recon.nodes.camera.reference_capture import ReferenceCapture
from active_recon.nodes.camera.view_inputs import ViewInputs
from active_recon.nodes.loop.mesh_publisher import meshing_imported
from active_recon.nodes.loop.mesh_saver import MeshSaver
from active_recon.nodes.loop.products import no_view_before, Products, Write
from active_recon.nodes.loop.reconstruction_publisher import ReconstructionPublisher
from active_recon.nodes.loop.told_runtime import tell_of_runtime
from active_recon.nodes.loop.view_warnings import ViewWarnings
from active_recon.nodes.runtime.deferred_work import DeferredWork
from active_recon.nodes.runtime.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.runtime.parameters import Commit, Parameters, set_read_only_parameter
from active_recon.nodes.runtime.qos import LATCHED_QOS, SENSOR_QOS
from active_recon.nodes.runtime.run import one_line
from active_recon.nodes.runtime.topic_names import publish_topic_names
from active_recon.parameters.reconstructor import ReconstructorParameters
from active_recon.reconstructor import Reconstruction, Reconstructor
from active_recon.saved_states import read_state
from active_recon.segmentation import Segmentation
import cv2
from geometry_msgs.msg import PoseStamped
from msg_tools.camera_images import is_compressed
from msg_tools.episodes import Episode, episode_to_msg
from msg_tools.goals import view_goal_from_msg
from msg_tools.images import mask_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.views import View
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from std_srvs.srv import Trigger

FACTS = {'weights_sha256': 'SHA-256 of the weights',
         'config_sha256': "SHA-256 of the network's config",
         'computed_by': 'what runs the network: library, version, precision, processor, threads',
         'needs_front': "whether the network needs the object's front"}
"""Read-only parameters that describe the network, with their descriptions."""
TOPICS = ('camera/image_raw', 'camera/camera_info', 'camera/pose', 'camera/mask', DEPTH_TOPIC,
          DEPTH_INFO_TOPIC, 'next_view', 'view', 'views', 'view_image', 'network_image',
          'occupancy', 'probabilities', 'latent', 'entropy', 'quality', 'episode', 'mesh')
"""Topics that the node subscribes to and publishes."""


class ReconstructorNode(ManagedNode):
    """Add the views that the gate accepts to the reconstruction, and publish it."""

    def __init__(self) -> None:
        super().__init__('reconstructor')
        self._params = Parameters(self, ReconstructorParameters)
        self._params.on_change(self._change)
        self._capture = ReferenceCapture(self, self._params.values.background)
        self._saver = MeshSaver(self, self._mesh_writer)

    def configure(self) -> None:
        """Load the network, create publishers and services."""
        params = self._params.values
        self._background = params.as_background()
        self._segmentation = self._segmenter(params)
        self.add_cleanup(self._capture.clear)
        publish_topic_names(self, TOPICS)
        check_pose_source(params)
        with meshing_imported() if params.publish_mesh else nullcontext():
            self._reconstructor = self._load(params)
        give_back_freed_memory()
        self._gate = ViewGate(
            params.take_views, params.goal_tolerance, params.min_view_separation,
            params.settle_time)
        self._inputs = ViewInputs(
            self, self._diagnostics, params, self._gate, self._capture, self._select)
        self._object_frame = params.object_frame
        self._warnings = ViewWarnings(self._diagnostics, self._reconstructor.spec.needs_front)
        self._products = Products(self, self._reconstructor, self._object_frame,
                                  params.publish_mesh)
        self.add_cleanup(self._free_network)
        provenance = self._reconstructor.provenance
        weights_sha256 = provenance.get('weights_sha256', '')
        self._publisher = ReconstructionPublisher(
            self, self._object_frame, self._reconstructor.judges_quality, weights_sha256)
        if self._reconstructor.no_quality:
            self.get_logger().info(self._reconstructor.no_quality)
        self._episode_pub = self.create_publisher(Header, 'episode', LATCHED_QOS)
        self._diagnostics.measure_rates('images', 'poses', 'views')
        self._diagnostics.set_value('Weights SHA-256', weights_sha256)
        tell_of_runtime(self._diagnostics, provenance)
        tell_of_runtime(self._diagnostics, self._segmentation.provenance if self._segmentation
                        else {}, 'Segmenter')
        self.create_service(Trigger, 'start_episode', self._on_start)
        self.create_service(Trigger, 'save_state', self._on_save_state)
        self.create_service(Trigger, 'load_state', self._on_load_state)

    def activate(self) -> None:
        """Begin an episode, and subscribe to the camera."""
        self._begin_episode()
        self._deferred = DeferredWork(self, self._take_pending_view)
        self.add_cleanup(self._deferred.close)
        # Before the camera's images, by which others discover that all is subscribed to
        self._goals = self.create_subscription(PoseStamped, 'next_view', self._on_goal, SENSOR_QOS)
        self._inputs.subscribe(self._params.values, self._deferred.note_message)

    def destroy_node(self) -> None:
        """Wait for a mesh that is being written, then free everything."""
        self._saver.close()
        super().destroy_node()

    def _free_network(self) -> None:
        del self._reconstructor, self._products, self._inputs, self._segmentation

    def _load(self, params: ReconstructorParameters) -> Reconstructor:
        """Load the network and run it once, so that the first view is as fast as the others."""
        # One thread by default: more would wait for the slowest of the loop's busy cores
        cv2.setNumThreads(params.threads)
        reconstructor = Reconstructor.load(
            find_weights(params.weights or None), params.device, params.object_size,
            params.object_yaw, _given(params.threshold), params.threads, params.runtime,
            params.precision)
        for fact, meaning in FACTS.items():
            set_read_only_parameter(self, fact, reconstructor.provenance.get(fact, ''), meaning)
        reconstructor.warm_up(params.use_depth)
        return reconstructor

    def _segmenter(self, params: ReconstructorParameters) -> Segmentation | None:
        """Load what finds the object in images, where it is asked for, and run it once."""
        if self._background.how != 'segment':
            return None
        found = Segmentation.load(Path(params.segmenter) if params.segmenter else None,
                                  params.device, params.threads, params.runtime, params.precision)
        found.warm_up()
        return found

    def _change(self, params: ReconstructorParameters) -> Commit | None:
        """Return a function that applies a change of parameters."""
        background = params.as_background()
        if not self.is_configured:
            return None

        def commit() -> None:
            self._background = background
            self._reconstructor.set_threshold(_given(params.threshold))
            self._inputs.set_limits(params)
            self._gate.take_views = params.take_views
            self._gate.goal_tolerance = params.goal_tolerance
            self._gate.min_view_separation = params.min_view_separation
            self._gate.settle_time = params.settle_time

        return commit

    def _begin_episode(self) -> None:
        self._pending: View | None = None
        self._reconstructor.reset()
        self._gate.reset()
        self._episode = Episode(uuid.uuid4().hex[:12], self.get_clock().now().nanoseconds)
        self._inputs.begin_episode(self._episode.begin)
        self._warnings.clear()
        self._diagnostics.count('episodes')
        self._diagnostics.set_value('Episode', self._episode.id)
        self._tell_view_count()
        self._publisher.begin_episode(self._episode.begin)
        self._episode_pub.publish(episode_to_msg(self._episode))
        self._products.begin_episode(self._episode)

    def clock_went_back(self, how: str) -> None:
        """Begin an episode: earlier views have stamps in the future."""
        if self.is_active:
            self._inputs.clock_went_back()
        self._begin_episode()
        self._diagnostics.count('clock_jumps')
        self.get_logger().warning(f'{how}: the episode {self._episode.id} begins')

    def _on_goal(self, msg: PoseStamped) -> None:
        with self._diagnostics.rejecting():
            stamp = nanoseconds_from_stamp(msg.header.stamp)
            if stamp == 0 < self._episode.begin:
                raise MessageError('goal without a stamp: expected that of when it was published, '
                                   'got 0; let its publisher fill in header.stamp', 'no_stamp')
            if stamp < self._episode.begin or self.clock_monitor.is_ahead(stamp):
                self._diagnostics.count('goals_unused')
                return
            self._take_pending_view()  # it belongs to the previous goal
            self._gate.set_goal(view_goal_from_msg(msg, self._object_frame), stamp)

    def _select(self, view: View) -> None:
        if not self._gate.wants(view.camera, view.stamp,
                                self.count_publishers(self._goals.topic_name) > 0):
            self._diagnostics.count('images_unused')
            return
        if self._pending is not None:
            self._diagnostics.count('dropped/overtaken')
        self._pending = view
        self._deferred.schedule()

    def _take_pending_view(self) -> None:
        view, self._pending = self._pending, None
        if view is not None:
            with self._diagnostics.rejecting():
                self._add_view(view)

    def _add_view(self, view: View) -> None:
        image, camera, is_cleared = self._prepared(view)
        depths = self._inputs.depths
        depth = None if depths is None else depths.of(view)
        reconstruction = self._reconstructor.add_view(image, camera, depth)
        if depths is not None and reconstruction.depth_refusal:
            depths.warn(reconstruction.depth_refusal)
        self._gate.took(view.camera)
        self._warnings.check_elevation(view.camera)
        self._diagnostics.count('views')
        self._publisher.publish_occupancy(
            view.stamp, reconstruction, self._reconstructor.threshold)
        self._diagnostics.record_latency(view.stamp)
        self._tell_view_count(at_once=False)
        self._publisher.publish_view(
            view.stamp, view.camera.pose, reconstruction, image if is_cleared else None)
        self._products.add_view(view.stamp, image, camera, reconstruction)
        self._check_shape(reconstruction)
        if self._background.how in ('segment', 'color', 'reference'):
            self._warnings.check_background(image)  # last: nothing waits for it

    def _check_shape(self, known: Reconstruction) -> None:
        self._warnings.check_shape(
            known, self._reconstructor.threshold, self._reconstructor.view_count)

    def _tell_view_count(self, at_once: bool = True) -> None:
        self._diagnostics.set_value(
            'Views of the episode', str(self._reconstructor.view_count), at_once)

    def _prepared(self, view: View) -> tuple[NDArray[np.uint8], Camera, bool]:
        """Return what is reconstructed with, its camera, and whether a background is removed."""
        if self._background.how == 'as_is':  # then nothing needs more pixels than the network
            by = (self._reconstructor.reduction(view.camera)
                  if is_compressed(view.image_msg) else 1)
            return *view.reduced(by), False
        mask = None if view.mask is None else mask_from_msg(view.mask)
        segmented = None if self._segmentation is None else partial(
            self._segmentation.on_white, camera=view.camera,
            object_size=self._reconstructor.object_size)
        image = self._background.cleared(view.image, mask, self._capture.reference, segmented)
        return image, view.camera, True

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Answer with the new episode's id."""
        if not self.is_active:
            response.message = 'this node is inactive: expected an active one to begin an episode'
            return response
        self._begin_episode()
        response.success = True
        response.message = self._episode.id
        return response

    def _mesh_writer(self) -> Write:
        """Return what writes the mesh of the shape now, where there is one."""
        if not self.is_configured:
            return no_view_before('a mesh')
        params = self._params.values
        return self._products.mesh_writer(Path(params.output_dir), params.mesh_format)

    def _on_save_state(self, _request: Trigger.Request,
                       response: Trigger.Response) -> Trigger.Response:
        """Answer with the path of the episode's state."""
        return self._products.save_state(Path(self._params.values.output_dir), response)

    def _on_load_state(self, _request: Trigger.Request,
                       response: Trigger.Response) -> Trigger.Response:
        """Begin an episode that goes on from the file of the parameter; answer with its id."""
        params = self._params.values
        if not self.is_active or not params.state_file:
            response.message = ('no state to load: expected an active node and its parameter '
                                f'state_file, got {params.state_file!r}')
            return response
        try:
            saved = read_state(Path(params.output_dir) / params.state_file, self._reconstructor)
        except DataError as error:
            response.message = one_line(error)
            return response
        self._begin_episode()
        self._reconstructor.go_on_from(saved.progress)
        self._tell_view_count()
        self._gate.took(saved.last_camera)
        self._products.take_up(saved)
        self._publisher.publish_occupancy(self._episode.begin, saved.reconstruction,
                                          self._reconstructor.threshold)
        self._check_shape(saved.reconstruction)
        response.success, response.message = True, self._episode.id
        return response


def _given(value: float) -> float | None:
    """Return a parameter's value, None where it is not given."""
    return None if math.isnan(value) else value


def main(args: list[str] | None = None) -> None:
    """Run the reconstructor until it is asked to stop."""
    run_managed_node(ReconstructorNode, args)


if __name__ == '__main__':
    main()
