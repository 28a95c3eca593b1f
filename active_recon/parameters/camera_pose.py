"""The parameters that say where the camera's poses come from."""

from dataclasses import dataclass

from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.parameters.declaration import parameter

POSE_SOURCES = ('topic', 'turntable_joint', 'tf')


@dataclass(frozen=True)
class CameraPoseSettings:
    """Of a node that knows where the camera is."""

    pose_source: str = parameter(
        'topic', "where the camera's poses come from: camera/pose, the angles of a turntable on "
        'turntable/joint_states, or tf2', choices=POSE_SOURCES)
    joint_name: str = parameter('', "the turntable's joint; empty for the only one")
    camera_position: tuple[float, ...] = parameter(
        (), "x, y, z of the camera in the object's frame while the turntable stands at 0, m")
    camera_orientation: tuple[float, ...] = parameter(
        (), 'x, y, z, w of its optical frame there')
    turntable_direction: int = parameter(
        1, "1 where the joint's angle grows counter-clockwise, seen from above, else -1", low=-1,
        high=1)

    def as_fixed_camera(self) -> FixedCamera:
        """Return the camera before the turntable; ConfigError where the parameters are none."""
        return FixedCamera.from_parameters(
            self.camera_position, self.camera_orientation, self.turntable_direction)
