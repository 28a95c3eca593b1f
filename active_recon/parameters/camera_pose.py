"""The parameters of the source of the camera's poses."""

from dataclasses import dataclass

from active_recon.geometry.turntable_pose import FixedCamera
from active_recon.parameters.declaration import parameter

POSE_SOURCES = ('topic', 'turntable_joint', 'tf')


@dataclass(frozen=True)
class CameraPoseParameters:
    """Parameters of a node that needs the camera's pose."""

    pose_source: str = parameter(
        'topic', "source of the camera's poses: camera/pose, the joint of a turntable on "
        'turntable/joint_states, or tf2', choices=POSE_SOURCES)
    joint_name: str = parameter('', "name of the turntable's joint; empty for the only one")
    camera_position: tuple[float, ...] = parameter(
        (), "x, y, z of the camera in the object's frame with the turntable at 0, m")
    camera_orientation: tuple[float, ...] = parameter(
        (), 'quaternion x, y, z, w of its optical frame there')
    turntable_direction: int = parameter(
        1, "1 if the joint's angle grows counter-clockwise seen from above, else -1", low=-1,
        high=1)

    def as_fixed_camera(self) -> FixedCamera:
        """Return the camera before the turntable; ConfigError where the parameters are invalid."""
        return FixedCamera.from_parameters(
            self.camera_position, self.camera_orientation, self.turntable_direction)
