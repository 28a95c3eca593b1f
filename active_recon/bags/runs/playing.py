"""What of a bag is played: its topics with their offered QoS, and their messages."""

from collections.abc import Collection, Iterator
from pathlib import Path

from active_recon.bags.storage.bag import RawMessage
from active_recon.bags.storage.metadata import Topic
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ConfigError
from active_recon.reporting import Reporting, silent
import numpy as np


def played_topics(bag: Path, rate: float, names: str = '',
                  reporting: Reporting = silent) -> list[Topic]:
    """
    Return the topics of a bag to play: those of `names`, or all if it is empty.

    The whole bag is read, so that a damaged one is rejected and not played in part. `names` are
    separated by commas and may lack the first '/'. Raises ConfigError if the rate is not above 0
    or the bag has no such topic, DataError if the bag is missing or damaged.
    """
    if not 0 < rate < float('inf'):
        raise ConfigError('--rate: invalid rate: expected one above 0, where 1 is that of the '
                          f'recording, got {rate:g}')
    topics = {topic.name: Topic(topic.name, topic.type_name, topic.qos)
              for topic in open_bag(bag).summary(reporting).topics if topic.count}
    wanted = [f'/{name.strip().lstrip("/")}' for name in names.split(',') if name] or list(topics)
    missing = [name for name in wanted if name not in topics]
    if missing:
        raise ConfigError(f'{bag}: no topics {", ".join(missing)} in the bag: expected some of '
                          f'{", ".join(sorted(topics))}')
    return [topics[name] for name in dict.fromkeys(wanted)]


def played_messages(bag: Path, topics: Collection[str]) -> Iterator[RawMessage]:
    """
    Yield the messages of the topics in the order of their reception, however they lie in the bag.

    Those that lie before their turn are held in memory: of a bag that was recorded, few. Raises
    DataError if the bag is damaged.
    """
    opened = open_bag(bag)
    received = np.fromiter((each.received for each in opened.messages(topics)), np.int64)
    lying = enumerate(opened.messages(topics))
    early: dict[int, RawMessage] = {}
    for turn in map(int, np.argsort(received, kind='stable')):
        while turn not in early:
            number, message = next(lying)
            early[number] = message
        yield early.pop(turn)
