"""The camera's images, raw or compressed, and how many were lost in transport."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.qos import SENSOR_QOS
from active_recon.nodes.runtime.topic_names import TRANSPORT_SUFFIXES
from active_recon.nodes.runtime.transport_selector import TransportSelector
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, Image

IMAGE_TOPIC = 'camera/image_raw'
IMAGE_SUFFIXES = dict(zip((Image, CompressedImage), TRANSPORT_SUFFIXES[IMAGE_TOPIC], strict=True))
"""The topic's suffix for each message type of the same images."""


class CameraImages:
    """Subscribes to `camera/image_raw` and to the compressed topic of the same images."""

    def __init__(self, node: Node, diagnostics: Diagnostics, inputs: AwaitedInputs,
                 on_image: Callable[[Image | CompressedImage], None],
                 on_lost: Callable[[], None]) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._inputs = inputs
        self._on_image = on_image
        self._on_lost = on_lost
        self._selector = TransportSelector()
        self._number = 0
        inputs.expect(IMAGE_TOPIC, IMAGE_SUFFIXES)
        # As in image_transport, the suffix follows the remapped name of the raw topic
        raw = node.resolve_topic_name(IMAGE_TOPIC)
        for kind, suffix in IMAGE_SUFFIXES.items():
            topic = f'{raw}{suffix}'
            node.create_subscription(kind, topic, partial(self._on_message, topic), SENSOR_QOS)

    def _on_message(self, topic: str, msg: Image | CompressedImage, info: dict[str, Any]) -> None:
        self._inputs.received(IMAGE_TOPIC)
        selected_before = self._selector.selected
        if not self._selector.accepts(topic, time.monotonic()):
            self._diagnostics.count('images_in_the_other_form')
            return
        number = info['publication_sequence_number']
        lost = number - self._number - 1 if topic == selected_before and self._number else 0
        # Each publisher numbers its own messages: with two of them gaps mean nothing
        if lost > 0 and self._node.count_publishers(topic) == 1:
            self._diagnostics.count('dropped/unheard', lost)
            self._on_lost()
        self._number = number
        self._on_image(msg)
