"""The interface of a bag in any storage: raw messages and a summary."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from active_recon.bags.runs.run import TopicSummary
from active_recon.bags.storage.metadata import Contents, Topic
from active_recon.reporting import Reporting, silent


@dataclass(frozen=True)
class RawMessage:
    """A serialized message (CDR) as it was published; times in nanoseconds since 1970."""

    topic: str
    type_name: str
    data: bytes
    received: int
    published: int


@dataclass(frozen=True)
class BagSummary:
    """
    The content of a bag; `begin` and `end` are receive times in ns, 0 if it has no message.

    `late` is the longest time in ns that a message was received before one that lies ahead of it.
    """

    topics: list[TopicSummary]
    begin: int
    end: int
    late: int
    provenance: Mapping[str, str]
    parameters: Mapping[str, Mapping[str, Any]]


def bag_summary(topics: Iterable[Topic], contents: Contents, provenance: Mapping[str, str],
                parameters: Mapping[str, Mapping[str, Any]]) -> BagSummary:
    """Return the summary of the counted messages; topics in the order of their names."""
    counted = [TopicSummary(topic.name, topic.type_name, contents.counts[topic.name], topic.qos)
               for topic in sorted(topics, key=lambda topic: topic.name)]
    return BagSummary(counted, contents.begin, contents.end, contents.late, provenance,
                      parameters)


class Bag(Protocol):
    """A bag that can be read any number of times."""

    def summary(self, reporting: Reporting = silent) -> BagSummary:
        """Read the whole bag and return its summary; raises DataError if it is damaged."""

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """Yield the topics' messages in the bag's order; raises DataError if it is damaged."""
