"""Options that supply what bags of other recorders do not contain."""

from collections.abc import Callable
from dataclasses import fields
from functools import wraps
import inspect
import math
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.cli.number_lists import listed_numbers
from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics

_PANEL = 'Bags of other recorders'


def _option(*names: str, **keywords: Any) -> Any:
    return typer.Option(*names, rich_help_panel=_PANEL, show_default=False, **keywords)


_TOPICS: dict[str, tuple[Any, Any]] = {
    'image': (Annotated[str, _option(
        metavar='TOPIC', help='Topic of the images (Image or CompressedImage).')], ''),
    'camera_info': (Annotated[str, _option(
        metavar='TOPIC', help='Topic of the camera info (CameraInfo).')], ''),
    'azimuth': (Annotated[str, _option(
        metavar='TOPIC',
        help='Topic of the camera pose (PoseStamped), of transforms (TFMessage), or of the '
             "camera's azimuth in radians (JointState of a turntable, or Float64).")], ''),
    'depth': (Annotated[str, _option(
        metavar='TOPIC',
        help='Topic of a depth camera (Image of 16UC1 or 32FC1, or compressedDepth), which is '
             'registered to the images or connected with them by transforms; default: none.')],
        ''),
    'joint': (Annotated[str, _option(
        metavar='NAME', help='Joint of the JointState, if it has several.')], ''),
    'turned_object': (Annotated[bool, _option(
        '--turned-object',
        help='The azimuth is the angle of a turntable in front of a fixed camera.')], False),
    'object_frame': (Annotated[str, _option(
        metavar='FRAME', help='Frame of the camera pose, or the one of the transforms that the '
                              'object is in; default: object.')], 'object'),
    'camera_frame': (Annotated[str, _option(
        metavar='FRAME', help="The camera's optical frame among the transforms; default: that of "
                              'the images.')], ''),
    'max_pose_gap': (Annotated[float, _option(
        min=0, metavar='SECONDS',
        help='Longest time from an image to the poses it is interpolated from; default: '
             '0.1.')], 0.1),
}
_SCENE: dict[str, tuple[Any, Any]] = {
    'object_size': (Annotated[float | None, _option(
        min=0.001, max=1000.0, metavar='METRES',
        help="Side of the object's cube; default: as recorded, else 1.")], None),
    'object_yaw_deg': (Annotated[float | None, _option(
        min=-360.0, max=360.0, metavar='DEGREES',
        help="Azimuth of the object's front; default: as recorded, else 0.")], None),
    'elevation_deg': (Annotated[float | None, _option(
        min=-89.0, max=89.0, metavar='DEGREES',
        help='Camera elevation, if the bag has azimuths only; default: 30.')], None),
    'camera_position': (Annotated[str | None, _option(
        metavar='X,Y,Z', help='Camera position in the object frame at angle 0, metres.')], None),
    'camera_orientation': (Annotated[str | None, _option(
        metavar='X,Y,Z,W', help='Camera orientation in the object frame at angle 0; default: it '
                                'looks at the object.')],
        None),
    'object_position': (Annotated[str | None, _option(
        metavar='X,Y,Z', help="Centre of the object's cube in --object-frame, metres; default: "
                              'its origin.')], None),
    'background': (Annotated[str, _option(
        metavar='segment|COLOR|IMAGE',
        help='Background to replace by white: all but the object that a learned segmenter finds '
             '(segment), a colour as RED,GREEN,BLUE, or an image of the empty scene.')], ''),
}


def with_bag_options(command: Callable[..., None]) -> Callable[..., None]:
    """Decorate a command: its parameters `topics` and `scene` come from these options."""
    own = inspect.signature(command).parameters
    given = {**_TOPICS, **_SCENE}

    @wraps(command)
    def run(**values: Any) -> None:
        from active_recon.bags.runs.topics import Topics

        topics = Topics(**{name: values.pop(name) for name in _TOPICS})
        scene = _scene(**{name: values.pop(name) for name in _SCENE})
        command(**values, topics=topics, scene=scene)

    options = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default,
                                 annotation=annotation)
               for name, (annotation, default) in given.items()]
    parameters = [*(each for name, each in own.items() if name not in ('topics', 'scene')),
                  *options]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run


def bag_options_given(topics: 'Topics', scene: 'Scene') -> set[str]:
    """Return the options that were given, of those that make these two."""
    options = {'object_yaw': '--object-yaw-deg', 'elevation': '--elevation-deg',
               'empty_scene': '--background'}
    return {options.get(each.name, f'--{each.name.replace("_", "-")}')
            for part in (topics, scene) for each in fields(part)
            if (getattr(part, each.name) is not None if each.default is None
                else getattr(part, each.name) != each.default)}


def _scene(object_size: float | None, object_yaw_deg: float | None, elevation_deg: float | None,
           camera_position: str | None, camera_orientation: str | None,
           object_position: str | None, background: str) -> 'Scene':
    from active_recon.bags.runs.scene import parse_background, Scene

    how, empty_scene = parse_background(background)
    return Scene(object_size, _radians(object_yaw_deg), _radians(elevation_deg),
                 _numbers('--camera-position', camera_position, 3),
                 _numbers('--camera-orientation', camera_orientation, 4),
                 _numbers('--object-position', object_position, 3), how, empty_scene)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)


def _numbers(option: str, text: str | None, count: int) -> list[float] | None:
    if text is None:
        return None
    numbers = listed_numbers(text)
    if len(numbers) != count:
        raise ConfigError(f'{option}: invalid list: expected {count} numbers separated by commas, '
                          f'got {text!r}')
    return numbers
