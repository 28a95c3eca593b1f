"""The depth camera beside the camera: its images and, where it has one, its camera info."""

from collections.abc import Callable
from functools import partial
import time

from active_recon.errors import MessageError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import SENSOR_QOS
from active_recon.nodes.runtime.topic_names import TRANSPORT_SUFFIXES
from active_recon.nodes.runtime.transport_selector import TransportSelector
from active_recon.volumes.depth_images import DepthImage
from msg_tools.cameras import intrinsics_from_msg
from msg_tools.compressed_depth import metres_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
from msg_tools.views import View, ViewJoiner
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

DEPTH_TOPIC, DEPTH_INFO_TOPIC = 'camera/depth/image_raw', 'camera/depth/camera_info'


class DepthImages:
    """Subscribes to depth images, raw or compressed, for a joiner; views ask for theirs."""

    def __init__(self, node: Node, diagnostics: Diagnostics, inputs: AwaitedInputs,
                 joiner: ViewJoiner, on_message: Callable[[], None]) -> None:
        self._diagnostics, self._joiner, self._on_message = diagnostics, joiner, on_message
        self._intrinsics: Intrinsics | None = None
        self._inputs, self._selector = inputs, TransportSelector()
        suffixes = dict(zip((Image, CompressedImage), TRANSPORT_SUFFIXES[DEPTH_TOPIC],
                            strict=True))
        inputs.expect(DEPTH_TOPIC, suffixes)
        raw = node.resolve_topic_name(DEPTH_TOPIC)
        for kind, suffix in suffixes.items():
            topic = f'{raw}{suffix}'
            node.create_subscription(kind, topic, partial(self._on_depth, topic), SENSOR_QOS)
        # Aligned depth need not have one: it has the lens of the image
        node.create_subscription(CameraInfo, DEPTH_INFO_TOPIC, self._on_info, SENSOR_QOS)

    def of(self, view: View) -> DepthImage | None:
        """Return the depth of a view, None and a warning where it has none that can be read."""
        if view.depth is None:
            self._diagnostics.warn('no_depth', 'view without depth: expected a depth image within '
                                   'max_depth_gap of its stamp, got none')
            return None
        try:
            return depth_image(view.depth, view.camera, self._intrinsics)
        except MessageError as error:
            self.warn(str(error))
            return None

    def warn(self, refusal: str) -> None:
        """Warn that a view goes on without its depth image, and count it."""
        self._diagnostics.warn('depth', f'view without depth: {refusal}')

    def _on_depth(self, topic: str, msg: Image | CompressedImage) -> None:
        self._inputs.received(DEPTH_TOPIC)
        if not self._selector.accepts(topic, time.monotonic()):
            return
        with self._diagnostics.rejecting():
            self._joiner.add_depth(nanoseconds_from_stamp(msg.header.stamp), msg)
        self._on_message()

    def _on_info(self, msg: CameraInfo) -> None:
        with self._diagnostics.rejecting():
            self._intrinsics = intrinsics_from_msg(msg)


def depth_image(msg: Image | CompressedImage, camera: Camera,
                intrinsics: Intrinsics | None) -> DepthImage:
    """
    Return the depth in a message beside an image of `camera`.

    `intrinsics` are those of its own camera info, in the optical frame of the image's camera; None
    where it has none. Raises MessageError as `metres_from_msg` does.
    """
    return DepthImage(metres_from_msg(msg),
                      camera if intrinsics is None else Camera(camera.pose, intrinsics))
