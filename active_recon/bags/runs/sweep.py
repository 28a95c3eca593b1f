"""Recording a bag with every view of a turntable, from which any policy can be replayed."""

from collections.abc import Callable, Mapping
from pathlib import Path
import time

from active_recon import __version__
from active_recon.bags.storage.atomic_bag import atomic_bag, write_message
from active_recon.bags.storage.metadata import QosProfile
from active_recon.bags.storage.writer import BagWriter
from active_recon.simulation.shown_object import ShownObject
from msg_tools.loop import image_to_msgs

IMAGES_EACH = 3
"""Images at each azimuth, so that the camera counts as still."""
_PERIOD_NS = 100_000_000
_STEP_NS = 1_000_000  # from stamp to receipt, and from one message of an image to the next


def record_sweep(shown: ShownObject, folder: Path, begin: int | None = None,
                 object_size: float = 1.0, advance: Callable[[], None] = lambda: None,
                 mesh: Mapping[str, str] | None = None) -> None:
    """
    Write a bag in which the camera goes around an object once and stops at each view.

    It has what the simulated turntable would have streamed at 10 Hz from `begin` on, nanoseconds
    since 1970; by default it ends now. `object_size` is the side of the object's cube, metres.
    `advance` is called after each view. `mesh` are those of the simulated camera's parameters
    `mesh`, `up` and `front` that were given: a report knows the truth by them. The folder appears
    when the bag is complete; raises RecordingError if it exists or the disk is full.
    """
    stamp = begin if begin is not None else (
        time.time_ns() - len(shown.images) * IMAGES_EACH * _PERIOD_NS)
    with atomic_bag(folder) as bag:
        bag.add_provenance({'version': __version__, 'object': shown.name})
        bag.attach_parameters('/turntable_camera', {'object_size': object_size, **(mesh or {})})
        for index in range(len(shown.images)):
            for _ in range(IMAGES_EACH):
                _write_view(bag, shown, index, stamp)
                stamp += _PERIOD_NS
            advance()


def _write_view(bag: BagWriter, shown: ShownObject, index: int, stamp: int) -> None:
    # The image comes last, as from the node: its subscribers then have its pose and lens.
    messages = image_to_msgs(stamp, shown.images[index], shown.cameras[index])
    for number, (topic, msg) in enumerate(messages.items(), start=1):
        received = stamp + number * _STEP_NS
        write_message(bag, f'/{topic}', msg, received, received - _STEP_NS, QosProfile())
