"""How the nodes publish, and how they hear a camera, which may be reliable or not."""

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Reliable, and the last one is kept for whoever comes late."""
STREAM = QoSProfile(depth=5)
"""Reliable; who listens best effort is served as well."""
HEARD = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Best effort, which hears reliable and best-effort publishers alike."""
HEARD_OFTEN = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)
"""The same for poses, of which a fast tracker sends many while the network runs."""
