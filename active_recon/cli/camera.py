"""`active-recon camera`: a webcam, a video file or a folder of images as ROS topics."""

import json
import os
from pathlib import Path
import sys
from typing import Annotated

import typer


def camera(
    source: Annotated[str, typer.Argument(
        help='Video device (/dev/video0, or 0), video file, or folder of images.')],
    camera_info: Annotated[Path | None, typer.Option(
        help="Lens in the YAML format of ROS's camera_calibration, such as the camera_info.yaml "
             'of `calibrate`.')] = None,
    rate: Annotated[float, typer.Option(
        min=0, max=1000, help='Images per second. Default: those of the device or file, and 10 '
                              'for a folder.')] = 0.0,
    size: Annotated[str, typer.Option(
        metavar='WIDTHxHEIGHT', help="Image size of a device. Default: the device's own.")] = '',
    frame: Annotated[str, typer.Option(
        help='Frame of the images.')] = 'camera_optical_frame',
    loop: Annotated[bool, typer.Option(
        '--loop', help='Begin a file or folder again after its end.')] = False,
    remap: Annotated[list[str] | None, typer.Option(
        '--remap', '-r', metavar='FROM:=TO',
        help='Remap a topic, or set the namespace with __ns:=/NAME; may be repeated.')] = None,
) -> None:
    """
    Publish a webcam, a video file or a folder of images as camera topics.

    For a camera without a ROS driver: camera/image_raw and camera/camera_info, until Ctrl-C. A
    device that is unplugged is searched for every second.

    Example: active-recon camera /dev/video0 --camera-info calibration/camera_info.yaml

    Example: active-recon camera film.mp4 --loop
    """
    from active_recon.errors import ConfigError

    width, _, height = size.lower().partition('x')
    # 0 would ask for the device's own, as no --size does
    if size and not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise ConfigError('--size: invalid size: expected WIDTHxHEIGHT above 0, e.g. 1280x720, '
                          f'got {size!r}')
    parameters = {
        'source': source, 'camera_info': '' if camera_info is None else str(camera_info),
        'camera_frame': frame, 'rate': rate, 'loop': loop, 'width': int(width or 0),
        'height': int(height or 0)}
    # ROS reads YAML, of which JSON is a part: a string in quotes is no number, whatever it holds
    given = [word for name, value in parameters.items()
             for word in ('-p', f'{name}:={json.dumps(value, ensure_ascii=False)}')]
    names = [word for each in remap or () for word in ('-r', each)]
    # The node replaces this process and receives its Ctrl-C
    os.execv(sys.executable, [sys.executable, '-m', 'active_recon.nodes.camera', '--ros-args',
                              *given, *names])
