"""Options that say where a bag of others has what a view needs."""

from typing import Annotated

import typer

ImageTopic = Annotated[str, typer.Option(
    '--image', help='Topic of the images; default: camera/image_raw, or the only one.')]
CameraInfoTopic = Annotated[str, typer.Option(
    '--camera-info', help='Topic of their CameraInfo; default: camera/camera_info, or the only '
                          'one.')]
AzimuthTopic = Annotated[str, typer.Option(
    '--azimuth', help="Topic of the camera's PoseStamped, or of an azimuth in radians as "
                      'JointState or Float64; default: camera/pose, or the only one.')]
JointName = Annotated[str, typer.Option(
    '--joint', help='Which joint of the JointState turns, where it has several.')]
TurnedObject = Annotated[bool, typer.Option(
    '--turned-object', help='The radians are those of a turntable under a fixed camera.')]
ObjectFrame = Annotated[str, typer.Option(
    '--object-frame', help='Frame in which the poses are given.')]
