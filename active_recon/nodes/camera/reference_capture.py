"""The service `capture_background`: the next image shows the empty scene."""

from collections.abc import Callable

from active_recon.nodes.runtime.clock import STEADY
import numpy as np
from numpy.typing import NDArray
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

IMAGE_WITHIN_S = 2.0
"""For so long the service waits for an image that was taken after the call."""


class ReferenceCapture:
    """
    Holds the image of the empty scene, once it was asked for.

    It lives as long as its node: a service that is destroyed while it waits could not answer.
    """

    def __init__(self, node: Node) -> None:
        self.reference: NDArray[np.uint8] | None = None
        self._node = node
        self._asked_at = 0
        self._image: Future | None = None
        # In a group of its own: while it waits for an image, that image must be let in.
        node.create_service(Trigger, 'capture_background', self._on_capture,
                            callback_group=MutuallyExclusiveCallbackGroup())

    def forget(self) -> None:
        """Have no image of the empty scene."""
        self.reference = None

    def image_came(self, stamp: int, read: Callable[[], NDArray[np.uint8]]) -> None:
        """
        Keep an image, at its stamp in nanoseconds, if one is waited for and it is new enough.

        What `read` raises where it is no image is passed on, and the next one is waited for.
        """
        if self._image is not None and not self._image.done() and stamp >= self._asked_at:
            self._image.set_result(read())

    async def _on_capture(self, _request: Trigger.Request,
                          response: Trigger.Response) -> Trigger.Response:
        """Answer when the image has come, or could not be waited for any longer."""
        self._asked_at = self._node.get_clock().now().nanoseconds
        image = self._image = Future()
        late = self._node.create_timer(
            IMAGE_WITHIN_S, lambda: image.done() or image.set_result(None),
            clock=STEADY)
        captured = await image
        self._node.destroy_timer(late)
        self._image = None
        if captured is None:
            response.message = ('expected an image of the empty scene that was taken after the '
                                f'call, none came within {IMAGE_WITHIN_S:g} s; is the camera '
                                'running and the node active?')
            return response
        self.reference = captured
        response.success = True
        response.message = f'captured {captured.shape[0]} x {captured.shape[1]} pixels'
        return response
