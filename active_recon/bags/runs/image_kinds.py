"""Which image topics are a camera's, and which are depth, masks or latents."""

from collections.abc import Sequence
from typing import Any

from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.storage.bag import Bag
from active_recon.bags.storage.message_types import COMPRESSED_IMAGE, read_message
from msg_tools.images import ENCODINGS, MASK_ENCODINGS
import numpy as np

_MASK_SHADES = 2  # object and background; a photograph has more


def non_camera_topics(bag: Bag, topics: Sequence[TopicSummary]) -> dict[str, str]:
    """
    Return the topics that are not a camera's, with what they show in words.

    Each topic is judged by its first message. Raises DataError if that is damaged.
    """
    waiting = {topic.name: topic.type_name for topic in topics}
    found: dict[str, str] = {}
    for message in bag.messages(set(waiting)) if waiting else ():
        if waiting.pop(message.topic, None) is not None:
            shown = (_in_compressed if message.type_name == COMPRESSED_IMAGE else _in_image)(
                message.topic, read_message(message))
            if shown:
                found[message.topic] = shown
        if not waiting:
            break
    return found


def _in_image(topic: str, msg: Any) -> str:
    if msg.encoding in ('16UC1', '32FC1'):
        return f'depth ({msg.encoding})'
    if msg.encoding in MASK_ENCODINGS and _is_mask(topic, msg):
        return f'a mask ({msg.encoding})'
    return '' if msg.encoding in ENCODINGS else f'images of encoding {msg.encoding!r}'


def _in_compressed(topic: str, msg: Any) -> str:
    encoding = str(msg.format)
    depth = 'compressedDepth' in encoding or '16UC1' in encoding
    return f'depth ({encoding})' if depth else ''


def _is_mask(topic: str, msg: Any) -> bool:
    shades = np.unique(np.asarray(msg.data, np.uint8))
    return topic.endswith('mask') or (
        len(shades) <= _MASK_SHADES and 0 in shades)
