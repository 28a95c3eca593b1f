"""The topics of a bag to play, with their offered QoS."""

from pathlib import Path

from active_recon.bags.storage.metadata import Topic
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ConfigError
from active_recon.reporting import Reporting, silent


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
