"""The camera's images, raw or compressed, whichever come, and how many were lost on the way."""

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from active_recon.nodes.runtime.awaited_inputs import AwaitedInputs
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.one_form import OneForm
from active_recon.nodes.runtime.qos import HEARD
from active_recon.nodes.runtime.topic_names import FORMS
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage, Image

NAME = 'camera/image_raw'
KINDS = dict(zip((Image, CompressedImage), FORMS[NAME], strict=True))
"""What the topics of the same images in each type end in."""


class CameraImages:
    """Hears `camera/image_raw`, and the topic beside it on which the same images come as JPEG."""

    def __init__(self, node: Node, diagnostics: Diagnostics, inputs: AwaitedInputs,
                 on_image: Callable[[Image | CompressedImage], None],
                 on_lost: Callable[[], None]) -> None:
        self._node = node
        self._diagnostics = diagnostics
        self._inputs = inputs
        self._on_image = on_image
        self._on_lost = on_lost
        self._form = OneForm()
        self._number = 0
        inputs.expect(NAME, KINDS)
        # Where image_transport has it, also under another name of the raw one
        raw = node.resolve_topic_name(NAME)
        for kind, suffix in KINDS.items():
            topic = f'{raw}{suffix}'
            node.create_subscription(kind, topic, partial(self._on_message, topic), HEARD)

    def _on_message(self, topic: str, msg: Image | CompressedImage, info: dict[str, Any]) -> None:
        self._inputs.heard(NAME)
        before = self._form.used
        if not self._form.takes(topic, time.monotonic()):
            self._diagnostics.count('images_in_the_other_form')
            return
        number = info['publication_sequence_number']
        lost = number - self._number - 1 if topic == before and self._number else 0
        # Each publisher counts for itself: with two of them the gaps say nothing
        if lost > 0 and self._node.count_publishers(topic) == 1:
            self._diagnostics.count('dropped/unheard', lost)
            self._on_lost()
        self._number = number
        self._on_image(msg)
