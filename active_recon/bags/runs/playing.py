"""What of a bag can be played: its topics, with the QoS that they were offered with."""

from pathlib import Path

from active_recon.bags.storage.metadata import Topic
from active_recon.bags.storage.opening import open_bag
from active_recon.errors import ConfigError
from active_recon.reporting import Reporting, silent


def played_topics(bag: Path, rate: float, names: str = '',
                  reporting: Reporting = silent) -> list[Topic]:
    """
    Return the topics of a bag that are to be played, all where no names are given.

    All of the bag is read for it, so that a damaged one is refused and not played in part. Names
    stand with commas between and may leave out the first '/'. Raises ConfigError where the rate
    is not above 0 or the bag has no such topic, DataError where there is no whole bag.
    """
    if not 0 < rate < float('inf'):
        raise ConfigError(f'--rate {rate:g}: expected a rate above 0, 1 being that of the '
                          'recording')
    topics = {topic.name: Topic(topic.name, topic.type_name, topic.qos)
              for topic in open_bag(bag).summary(reporting).topics if topic.count}
    wanted = [f'/{name.strip().lstrip("/")}' for name in names.split(',') if name] or list(topics)
    missing = [name for name in wanted if name not in topics]
    if missing:
        raise ConfigError(f'{bag}: expected topics of the bag, which are '
                          f'{", ".join(sorted(topics))}, got {", ".join(missing)}')
    return [topics[name] for name in dict.fromkeys(wanted)]
