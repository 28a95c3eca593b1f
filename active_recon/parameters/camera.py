"""The parameters of the camera's driver."""

from dataclasses import dataclass

from active_recon.parameters.declaration import parameter
from active_recon.parameters.shared import ManagedParameters


@dataclass(frozen=True)
class CameraParameters(ManagedParameters):
    """Parameters of the camera's driver."""

    source: str = parameter(
        '', 'what is published: a video device such as /dev/video0, a video file, or a folder of '
        'images', path=True)
    camera_info: str = parameter(
        '', "lens in the YAML format of ROS's camera_calibration, as camera_info_manager and "
        'calibrate write it; empty for a camera that is not calibrated', path=True)
    camera_frame: str = parameter('camera_optical_frame', 'frame of the images', needed=True)
    rate: float = parameter(
        0.0, 'images per second; 0 for those of the device or file, and 10 for a folder',
        low=0.0, high=1000.0)
    width: int = parameter(
        0, "width asked of a device, pixels; 0 for the device's own", low=0, high=20000)
    height: int = parameter(
        0, "height asked of a device, pixels; 0 for the device's own", low=0, high=20000)
    loop: bool = parameter(False, 'whether a file or folder begins again after its end')
