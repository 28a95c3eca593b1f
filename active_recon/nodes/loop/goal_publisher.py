"""Publishes the planner's goals, each with a unique stamp, until its view has been taken."""

import math

from active_recon.acquisition.goals import Goal
from active_recon.geometry.cameras import Camera
from active_recon.nodes.runtime.qos import LATCHED_QOS
from active_recon.policies.reasons import GoalReason
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from msg_tools.goals import azimuth_goal_to_msg, scores_to_msg, view_goal_to_msg
from msg_tools.reasons import goal_reason_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from rclpy.node import Node
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Header


class GoalPublisher:
    """
    Publishes `next_view`, `next_azimuth` and `azimuth_scores`; at most one goal is open.

    A goal is a camera in the object's frame, and for a turntable its azimuth. Its `goal_reason`
    follows under the same stamp.
    """

    def __init__(self, node: Node, frame: str) -> None:
        self._node = node
        self._frame = frame
        self._last_stamp = 0
        self._open: tuple[PoseStamped, JointState] | None = None
        self._since = 0
        self.camera: Camera | None = None
        self._next_view_pub = node.create_publisher(PoseStamped, 'next_view', LATCHED_QOS)
        self._next_azimuth_pub = node.create_publisher(JointState, 'next_azimuth', LATCHED_QOS)
        self._scores_pub = node.create_publisher(PointCloud2, 'azimuth_scores', LATCHED_QOS)
        self._reason_pub = node.create_publisher(DiagnosticArray, 'goal_reason', LATCHED_QOS)

    @property
    def open_for(self) -> float:
        """
        Seconds for which the goal has been open, by the node's clock; NaN if none is.

        A goal from before a simulation's clock began is open since it began.
        """
        if self.camera is None:
            return math.nan
        now = self._node.get_clock().now().nanoseconds
        self._since = self._since or now
        return (now - self._since) / 1e9

    def publish(self, goal: Goal, begin: int) -> None:
        """Publish a goal of an episode, by its begin, with a unique stamp, its identity."""
        self.camera = goal.camera
        self._since = self._node.get_clock().now().nanoseconds
        # A paused clock would give two goals one identity; and the begin is by the
        # reconstructor's clock, which takes an earlier goal for another episode's
        self._last_stamp = max(self._since, self._last_stamp + 1, begin)
        header = Header(stamp=stamp_from_nanoseconds(self._last_stamp), frame_id=self._frame)
        self._open = (view_goal_to_msg(goal.camera, header),
                       azimuth_goal_to_msg(goal.camera.azimuth, header))
        self.repeat()  # the camera may begin to move; the scores are for people
        self._scores_pub.publish(scores_to_msg(goal.candidates, goal.scores, header))

    def publish_reason(self, reason: GoalReason) -> None:
        """Publish why the last goal is worth its view."""
        self._reason_pub.publish(goal_reason_to_msg(reason, Header(
            stamp=stamp_from_nanoseconds(self._last_stamp), frame_id=self._frame)))

    def repeat(self) -> None:
        """Publish the open goal again, with the same stamp: it may have been lost."""
        if self._open is not None:
            next_view, next_azimuth = self._open
            self._next_view_pub.publish(next_view)
            self._next_azimuth_pub.publish(next_azimuth)

    def reset_stamps(self) -> None:
        """Allow the next stamp to be earlier than the last: the clock jumped back."""
        self._last_stamp = 0

    def close(self) -> None:
        """Close the goal: it is not published again."""
        self._open = self.camera = None
