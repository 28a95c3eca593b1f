"""What of a bag is played: its topics with their offered QoS, and their messages."""

from collections.abc import Iterator
from dataclasses import dataclass
import heapq
from pathlib import Path

from active_recon.bags.storage.bag import Bag, RawMessage
from active_recon.bags.storage.metadata import Topic
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ConfigError, DataError
from active_recon.reporting import Reporting, silent


@dataclass(frozen=True)
class Played:
    """The topics of a bag to play; `late` as in `BagSummary`."""

    topics: list[Topic]
    late: int
    bag: Bag

    def messages(self) -> Iterator[RawMessage]:
        """
        Yield the topics' messages in the order of their reception, however they lie in the bag.

        Those that lie before their turn are held in memory: of a bag that was recorded, few.
        Raises DataError if the bag is damaged.
        """
        held: list[tuple[int, int, RawMessage]] = []  # of one time, in the bag's order
        newest = 0
        for number, message in enumerate(self.bag.messages([each.name for each in self.topics])):
            heapq.heappush(held, (message.received, number, message))
            newest = max(newest, message.received)
            while held[0][0] < newest - self.late:
                yield heapq.heappop(held)[2]
        while held:
            yield heapq.heappop(held)[2]


def played(path: Path, rate: float, names: str = '', reporting: Reporting = silent) -> Played:
    """
    Return what of a bag to play: the topics of `names`, or all if it is empty.

    The whole bag is read, so that a damaged one is rejected and not played in part. `names` are
    separated by commas and may lack the first '/'. Raises ConfigError if the rate is not above 0
    or the bag has no such topic, DataError if the bag is missing, damaged or without messages.
    """
    if not 0 < rate < float('inf'):
        raise ConfigError('--rate: invalid rate: expected one above 0, where 1 is that of the '
                          f'recording, got {rate:g}')
    bag = open_bag(path)
    summary = bag.summary(reporting)
    topics = {topic.name: Topic(topic.name, topic.type_name, topic.qos)
              for topic in summary.topics if topic.count}
    wanted = [f'/{name.strip().lstrip("/")}' for name in names.split(',') if name] or list(topics)
    if not topics:
        raise DataError(f'{path}: nothing to play: expected a bag with messages, got one without')
    missing = [name for name in wanted if name not in topics]
    if missing:
        raise ConfigError(f'{path}: no topics {", ".join(missing)} in the bag: expected some of '
                          f'{", ".join(sorted(topics))}')
    return Played([topics[name] for name in dict.fromkeys(wanted)], summary.late, bag)
