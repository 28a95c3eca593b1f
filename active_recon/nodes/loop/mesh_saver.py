"""The service `save_mesh`: a mesh is made beside the loop and not in its way."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from active_recon.nodes.loop.products import Write
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger


class MeshSaver:
    """
    Serves `save_mesh`: calls what `writer` returns in a thread, and answers once it is done.

    `writer` is called with each request, in the executor. The service lives as long as its node:
    one that is destroyed while a mesh is made cannot answer.
    """

    def __init__(self, node: Node, writer: Callable[[], Write]) -> None:
        self._node = node
        self._writer = writer
        self._thread = ThreadPoolExecutor(1, 'save_mesh')
        # In a group of its own: images must arrive while the service waits for the thread
        node.create_service(Trigger, 'save_mesh', self._on_save,
                            callback_group=MutuallyExclusiveCallbackGroup())

    def close(self) -> None:
        """Wait for the mesh that is being made."""
        self._thread.shutdown()

    async def _on_save(self, _request: Trigger.Request,
                       response: Trigger.Response) -> Trigger.Response:
        """Answer with the path of the mesh."""
        done = Future()
        making = self._thread.submit(self._writer(), response)
        making.add_done_callback(lambda _: self._wake(done))
        await done
        return making.result()

    def _wake(self, done: Future) -> None:
        """Let the executor go on with a service; it would not look before the next message."""
        executor = self._node.executor
        if executor is not None:
            executor.create_task(done.set_result, None)
