"""ROS node of a camera without a driver: a video device, a video file, or a folder of images."""

from functools import partial
from pathlib import Path

from active_recon.calibration.lens import read_lens
from active_recon.capture.grabber import Grabbed, Grabber
from active_recon.capture.sources import fitting_lens, ImageSource, open_source
from active_recon.errors import ActiveReconError
from active_recon.nodes.runtime.life_cycle import ManagedNode, run_managed_node
from active_recon.nodes.runtime.parameters import Parameters
from active_recon.nodes.runtime.qos import STREAM_QOS
from active_recon.nodes.runtime.run import one_line
from active_recon.parameters.camera import CameraParameters
from msg_tools.cameras import intrinsics_to_msg
from msg_tools.images import image_to_msg
from msg_tools.stamps import stamp_from_nanoseconds
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

_GONE = 'no_camera'


class CameraNode(ManagedNode):
    """Publish images with their camera info, under one stamp: when the image came."""

    def __init__(self) -> None:
        super().__init__('camera')
        self._params = Parameters(self, CameraParameters)
        self._opened: ImageSource | None = None

    def configure(self) -> None:
        """Open the source, read the lens and create the publishers."""
        params = self._params.values
        self._lens = read_lens(Path(params.camera_info)) if params.camera_info else None
        self._opened = self._open()
        self.add_cleanup(self._give_back)
        self._diagnostics.measure_rates('images')
        self._info_pub = self.create_publisher(CameraInfo, 'camera/camera_info', STREAM_QOS)
        # Last: who discovers the images has discovered what belongs to them
        self._image_pub = self.create_publisher(Image, 'camera/image_raw', STREAM_QOS)
        width, height = self._opened.size
        self.get_logger().info(f'{self._opened.name}: {width} x {height} pixels')
        if self._lens is None:
            self.get_logger().warning(
                'not calibrated: the camera info has no focal length, and the reconstructor will '
                'refuse it; give one by camera_info, `active-recon calibrate` makes it')

    def activate(self) -> None:
        """Begin to read."""
        source, self._opened = self._opened, None
        guard = self.create_guard_condition(self._publish)
        self.add_cleanup(lambda: self.destroy_guard_condition(guard))
        self._grabber = Grabber(
            self._open() if source is None else source, self._open, self._params.values.loop,
            lambda: self.get_clock().now().nanoseconds, guard.trigger)
        self.add_cleanup(self._grabber.close)
        self.add_cleanup(lambda: self._diagnostics.clear_warning(_GONE, log=False))

    def clock_went_back(self, how: str) -> None:
        """Go on: images have the stamps of the new time."""

    def _open(self) -> ImageSource:
        params = self._params.values
        source = open_source(params.source, params.width, params.height, params.rate)
        try:
            if self._lens is not None:
                fitting_lens(self._lens, source.size, params.camera_info)
        except ActiveReconError:
            source.close()
            raise
        return source

    def _give_back(self) -> None:
        if self._opened is not None:
            self._opened.close()
            self._opened = None

    def _publish(self) -> None:
        """Publish what has come."""
        for come in self._grabber.take():
            if come.image is not None:
                self._diagnostics.clear_warning(_GONE)
                self._send(come)
            elif come.problem is None:
                self.get_logger().info('the end of the source: no more images come')
            elif come.lasting:
                self._diagnostics.raise_warning(
                    _GONE, f'{one_line(come.problem)}; it is searched for every second')
            else:
                self._diagnostics.reject(come.problem)

    def _send(self, come: Grabbed) -> None:
        assert come.image is not None
        header = Header(stamp=stamp_from_nanoseconds(come.stamp),
                        frame_id=self._params.values.camera_frame)
        height, width = come.image.shape[:2]
        # Zeros are ROS's way to say that a camera is not calibrated
        make = (partial(CameraInfo, height=height, width=width) if self._lens is None
                else partial(intrinsics_to_msg, self._lens))
        self._info_pub.publish(make(header=header))
        self._image_pub.publish(image_to_msg(come.image, header))
        self._diagnostics.count('images')


def main(args: list[str] | None = None) -> None:
    """Run the camera until it is asked to stop."""
    run_managed_node(CameraNode, args)
