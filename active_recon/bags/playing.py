"""What of a bag can be played: its topics, with the QoS that they were offered with."""

from pathlib import Path

from active_recon.bags.metadata import DURABILITIES, QosProfile, RELIABILITIES, Topic
from active_recon.errors import ConfigError, DataError
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader


def played_topics(bag: Path, rate: float, names: str = '') -> list[Topic]:
    """
    Return the topics of a bag that are to be played, all where no names are given.

    Names stand with commas between and may leave out the first '/'. Raises ConfigError where the
    rate is not above 0 or the bag has no such topic, DataError where there is no whole bag.
    """
    if not 0 < rate < float('inf'):
        raise ConfigError(f'expected a rate above 0, 1 being that of the recording, got {rate:g}')
    topics = {topic.name: topic for topic in _recorded_topics(bag)}
    wanted = [f'/{name.strip().lstrip("/")}' for name in names.split(',') if name] or list(topics)
    missing = [name for name in wanted if name not in topics]
    if missing:
        raise ConfigError(f'{bag}: expected topics of the bag, which are '
                          f'{", ".join(sorted(topics))}, got {", ".join(missing)}')
    return [topics[name] for name in dict.fromkeys(wanted)]


def _recorded_topics(bag: Path) -> list[Topic]:
    if not bag.exists():
        raise DataError(f'{bag}: expected a bag, but there is nothing')
    try:
        with Reader(bag) as reader:
            return [Topic(each.topic, each.msgtype, _offered(each))
                    for each in reader.connections if each.msgcount]
    except Exception as error:  # the library raises whatever damaged bytes lead it to
        raise DataError(f'{bag}: expected a whole bag, got: {" ".join(str(error).split())}; '
                        'where its recording was cut off, `active-recon bag repair` helps'
                        ) from error


def _offered(connection: Connection) -> tuple[QosProfile, ...]:
    profiles = getattr(connection.ext, 'offered_qos_profiles', ())
    named = ((profile.reliability.name.lower(), profile.durability.name.lower())
             for profile in profiles)
    return tuple(QosProfile(reliability, durability) for reliability, durability in named
                 if reliability in RELIABILITIES and durability in DURABILITIES)
