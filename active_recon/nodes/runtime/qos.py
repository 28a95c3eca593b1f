"""QoS profiles of the nodes, and how a topic's QoS is recorded and offered again."""

from collections.abc import Iterable

from active_recon.bags.storage.metadata import QosProfile
from rclpy.duration import Infinite
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Reliable and transient local: late subscribers receive the last message."""
LATCHED_POLLED_QOS = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""For latched topics that are polled: a deeper queue, so that nothing is lost between polls."""
STREAM_QOS = QoSProfile(depth=5)
"""Publishes streams: reliable, which is compatible with best-effort subscribers."""
SENSOR_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Subscribes best effort: compatible with reliable and best-effort publishers."""
HIGH_RATE_QOS = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)
"""As `SENSOR_QOS`, with room for the poses that arrive while the network runs."""
_UNKNOWN_NODE = '_NODE_NAME_UNKNOWN_'  # an endpoint may be discovered before its node's name
NOTHING_COMES = ('which nothing gets here, not even its name: run all nodes of a machine as one '
                 'user and with one /dev/shm, or all with FASTDDS_BUILTIN_TRANSPORTS=UDPv4')
"""
Of a node whose name stays unknown, after 'of'.

Discovery goes by UDP, all else by the shared memory of what Fast DDS takes for one machine, which
other users and containers cannot open.
"""


def endpoint_node(endpoint: TopicEndpointInfo) -> str | None:
    """Return the full name of the endpoint's node; None while it is not known."""
    if endpoint.node_name == _UNKNOWN_NODE:
        return None
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'


def offered_profile(publisher: TopicEndpointInfo) -> QosProfile:
    """Return the QoS that a publisher offers, as a bag records it."""
    profile = publisher.qos_profile
    return QosProfile(profile.reliability.name.lower(), profile.durability.name.lower())


def common_profile(offered: Iterable[QosProfile], depth: int) -> QoSProfile:
    """Return the strictest profile that is compatible with all of the publishers."""
    offered = list(offered)
    reliable = all(profile.reliability == 'reliable' for profile in offered)
    latched = bool(offered) and all(
        profile.durability == 'transient_local' for profile in offered)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE))


def profile_words(profile: QoSProfile) -> str:
    """Describe the policies that decide whether two profiles are compatible."""
    words = [profile.reliability.name, profile.durability.name]
    if 0 < profile.deadline.nanoseconds < Infinite.nanoseconds:
        words.append(f'deadline {profile.deadline.nanoseconds / 1e9:g} s')
    if profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC:
        words.append('liveliness manual by topic')
    if 0 < profile.liveliness_lease_duration.nanoseconds < Infinite.nanoseconds:
        words.append(f'lease {profile.liveliness_lease_duration.nanoseconds / 1e9:g} s')
    return ', '.join(words).lower().replace('_', ' ')
