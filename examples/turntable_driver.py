"""
A driver of a real turntable: it turns to the planner's goals and tells where the table stands.

    python3 examples/turntable_driver.py --ros-args --params-file calibration/calibration.yaml

It hears `next_azimuth` and publishes `turntable/joint_states`, from which the reconstructor, with
`pose_source: turntable_joint`, knows the camera's pose. It runs as it is, with a simulated motor.
For yours, change the two lines of `Motor` that say what your controller is told and answers, and
hand it your port in `main`: `serial.Serial('/dev/ttyUSB0', 115200, timeout=1)`.
"""

import math
import signal
import time

from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

TURN = 2 * math.pi


class SimulatedPort:
    """A motor's controller behind a serial port, which turns at `speed` degrees a second."""

    def __init__(self, speed: float = 60.0) -> None:
        self._speed = speed
        self._start = self._goal = 0.0
        self._left_at = time.monotonic()
        self._answer = b''

    def write(self, line: bytes) -> None:
        """Take a command: `GO <degrees>` or `WHERE`."""
        command, *rest = line.split()
        if command == b'GO':
            self._start, self._goal = self._angle(), float(rest[0])
            self._left_at = time.monotonic()
        elif command == b'WHERE':
            self._answer = b'%.3f\n' % self._angle()

    def readline(self) -> bytes:
        """Return the answer to the last `WHERE`, b'' where there is none."""
        answer, self._answer = self._answer, b''
        return answer

    def _angle(self) -> float:
        turned = (time.monotonic() - self._left_at) * self._speed
        way = self._goal - self._start
        return self._start + math.copysign(min(turned, abs(way)), way)


class Motor:
    """The turntable's motor; its angles are radians and may be more than a turn."""

    def __init__(self, port: SimulatedPort) -> None:
        self._port = port

    def turn_to(self, angle: float) -> None:
        """Leave for an angle and return at once."""
        self._port.write(b'GO %.3f\n' % math.degrees(angle))

    def angle(self) -> float:
        """Return where the table stands; raises ValueError where the controller does not say."""
        self._port.write(b'WHERE\n')
        return math.radians(float(self._port.readline()))


class TurntableDriver(Node):
    """Turn the table so that the camera is at the azimuth that is asked for."""

    def __init__(self, motor: Motor) -> None:
        super().__init__('turntable_driver')
        self._motor = motor
        # Both as `active-recon calibrate` writes them; 1 may stand for 1.0
        either = ParameterDescriptor(dynamic_typing=True)
        self._azimuth_at_zero = float(
            self.declare_parameter('camera_azimuth_at_zero', 0.0, either).value)
        self._direction = self.declare_parameter('turntable_direction', 1, either).value
        if self._direction not in (1, -1):
            raise SystemExit(f'turntable_direction: expected 1 or -1, got {self._direction}')
        self._goal_stamp = None
        self._publisher = self.create_publisher(JointState, 'turntable/joint_states', 10)
        self.create_subscription(
            JointState, 'next_azimuth', self._on_goal, qos_profile_sensor_data)
        self.create_timer(0.05, self._tell)
        self.get_logger().info('ready')

    def _on_goal(self, msg: JointState) -> None:
        """Turn the short way to where the camera's azimuth is that of the goal."""
        if msg.header.stamp == self._goal_stamp:
            return  # an open goal is sent again every second
        if len(msg.position) != 1 or not math.isfinite(msg.position[0]):
            self.get_logger().warning(f'expected one finite azimuth, got {list(msg.position)}')
            return
        # An object that turns counter-clockwise takes the fixed camera clockwise around it
        wanted = self._direction * (self._azimuth_at_zero - msg.position[0])
        try:
            now = self._motor.angle()
            self._motor.turn_to(now + math.remainder(wanted - now, TURN))
        except (OSError, ValueError) as error:
            self.get_logger().error(f'the motor does not answer: {error}')
        else:
            self._goal_stamp = msg.header.stamp

    def _tell(self) -> None:
        try:
            angle = self._motor.angle()
        except (OSError, ValueError) as error:
            self.get_logger().error(
                f'the motor does not answer: {error}', throttle_duration_sec=5.0)
            return
        msg = JointState(name=['turntable'], position=[angle])
        msg.header.stamp = self.get_clock().now().to_msg()
        self._publisher.publish(msg)


def main() -> None:
    """Drive the table until Ctrl-C."""
    # One way out for Ctrl-C and for whoever supervises the driver
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    for request in (signal.SIGINT, signal.SIGTERM):
        signal.signal(request, signal.default_int_handler)
    try:
        rclpy.spin(TurntableDriver(Motor(SimulatedPort())))
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
