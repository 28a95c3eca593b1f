"""The service `capture_background`: the next image shows the empty scene."""

from collections.abc import Callable

from active_recon.nodes.runtime.clock import STEADY
import numpy as np
from numpy.typing import NDArray
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

IMAGE_TIMEOUT_S = 2.0
"""Time to wait for an image that was taken after the call."""


class ReferenceCapture:
    """
    Serves `capture_background` and holds the image of the empty scene.

    It lives as long as its node: a service that is destroyed while it waits cannot answer. Where
    `background` is not reference, nothing would use the image, and the service says so.
    """

    def __init__(self, node: Node, background: str) -> None:
        self._background = background
        self.reference: NDArray[np.uint8] | None = None
        self._node = node
        self._called_at = 0
        self._image: Future | None = None
        # In a group of its own: images must arrive while the service waits for one.
        node.create_service(Trigger, 'capture_background', self._on_capture,
                            callback_group=MutuallyExclusiveCallbackGroup())

    def clear(self) -> None:
        """Forget the image of the empty scene."""
        self.reference = None

    def on_image(self, stamp: int, read: Callable[[], NDArray[np.uint8]]) -> None:
        """
        Keep an image, at its stamp in nanoseconds, if the service waits for one and it is new.

        Passes on what `read` raises; the service then waits for the next image.
        """
        if self._image is not None and not self._image.done() and stamp >= self._called_at:
            self._image.set_result(read())

    async def _on_capture(self, _request: Trigger.Request,
                          response: Trigger.Response) -> Trigger.Response:
        """Answer when the image has arrived, or after the timeout."""
        if self._background != 'reference':
            response.message = ('the image of the empty scene would change nothing: expected the '
                                f'parameter background to be reference, got {self._background}; '
                                'start the node with background:=reference')
            return response
        self._called_at = self._node.get_clock().now().nanoseconds
        image = self._image = Future()
        late = self._node.create_timer(
            IMAGE_TIMEOUT_S, lambda: image.done() or image.set_result(None),
            clock=STEADY)
        captured = await image
        self._node.destroy_timer(late)
        self._image = None
        if captured is None:
            response.message = ('no image of the empty scene: expected one that was taken after '
                                f'the call, none came within {IMAGE_TIMEOUT_S:g} s; is the camera '
                                'running and the node active?')
            return response
        self.reference = captured
        response.success = True
        response.message = f'captured {captured.shape[1]} x {captured.shape[0]} pixels'
        return response
