"""The camera's images, raw or compressed, whichever come, and how many were lost on the way."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from active_recon.nodes.diagnostics import Diagnostics
from active_recon.nodes.qos import HEARD
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, Image

OTHER_FORM_AFTER_S = 1.0
"""A camera may publish each image in both forms: one is used until it is silent for so long."""


class CameraImages:
    """Hears `camera/image_raw`, and the topic beside it on which the same images come as JPEG."""

    def __init__(self, node: Node, diagnostics: Diagnostics,
                 on_image: Callable[[Image | CompressedImage], None]) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._on_image = on_image
        self._topic = ''
        self._heard_at = 0.0
        self._number = 0
        # Where image_transport has it, also under another name of the raw one
        raw = node.resolve_topic_name('camera/image_raw')
        for kind, topic in ((Image, raw), (CompressedImage, f'{raw}/compressed')):
            node.create_subscription(kind, topic, partial(self._on_message, topic), HEARD)

    def _on_message(self, topic: str, msg: Image | CompressedImage, info: dict[str, Any]) -> None:
        now = time.monotonic()
        if topic != self._topic and now - self._heard_at < OTHER_FORM_AFTER_S:
            self._diagnostics.count('images_in_the_other_form')
            return
        number = info['publication_sequence_number']
        lost = number - self._number - 1 if topic == self._topic and self._number else 0
        # Each publisher counts for itself: with two of them the gaps say nothing
        if lost > 0 and self._node.count_publishers(topic) == 1:
            self._diagnostics.count('dropped/unheard', lost)
        self._topic, self._heard_at, self._number = topic, now, number
        self._on_image(msg)
