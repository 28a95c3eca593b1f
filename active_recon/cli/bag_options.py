"""The options by which a command is told what other people's bags do not tell."""

from collections.abc import Callable
from functools import wraps
import inspect
import math
from typing import Annotated, Any, TYPE_CHECKING

from active_recon.errors import ConfigError
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.scene import Scene

_PANEL = "Other people's bags"


def _option(*names: str, **told: Any) -> Any:
    return typer.Option(*names, rich_help_panel=_PANEL, show_default=False, **told)


_TOPICS: dict[str, tuple[Any, Any]] = {
    'image': (Annotated[str, _option(metavar='TOPIC', help='Image or CompressedImage.')], ''),
    'camera_info': (Annotated[str, _option(metavar='TOPIC', help='CameraInfo.')], ''),
    'azimuth': (Annotated[str, _option(
        metavar='TOPIC',
        help="PoseStamped of the camera; or its azimuth, radians, as a turntable's JointState or "
             'a Float64.')], ''),
    'joint': (Annotated[str, _option(
        metavar='NAME', help='Of the JointState, if it has several.')], ''),
    'turned_object': (Annotated[bool, _option(
        '--turned-object',
        help='The azimuth is that of the turntable under a fixed camera.')], False),
    'object_frame': (Annotated[str, _option(
        metavar='FRAME', help='Frame of the PoseStamped; default: object.')], 'object'),
    'max_pose_gap': (Annotated[float, _option(
        min=0, metavar='SECONDS',
        help='From an image to the poses that its own lies between; default: 0.1.')], 0.1),
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
        help='Of the camera, where the bag has azimuths alone; default: 30.')], None),
    'camera_position': (Annotated[str | None, _option(
        metavar='X,Y,Z', help="Of the camera in the object's frame at angle 0, m.")], None),
    'camera_orientation': (Annotated[str | None, _option(
        metavar='X,Y,Z,W', help='Of its optical frame there; default: it looks at the object.')],
        None),
    'background': (Annotated[str, _option(
        metavar='COLOR|IMAGE',
        help='What becomes white behind the object: a colour as RED,GREEN,BLUE, or what an image '
             'of the empty scene shows.')], ''),
}


def with_bag_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command its parameters `topics` and `scene` from options of its command line."""
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


def _scene(object_size: float | None, object_yaw_deg: float | None, elevation_deg: float | None,
           camera_position: str | None, camera_orientation: str | None,
           background: str) -> 'Scene':
    from active_recon.bags.runs.scene import Scene, told_background

    how, empty_scene = told_background(background)
    return Scene(object_size, _radians(object_yaw_deg), _radians(elevation_deg),
                 _numbers('--camera-position', camera_position, 3),
                 _numbers('--camera-orientation', camera_orientation, 4), how, empty_scene)


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)


def _numbers(option: str, told: str | None, count: int) -> list[float] | None:
    if told is None:
        return None
    try:
        numbers = [float(each) for each in told.split(',')]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ConfigError(f'{option}: {told!r} is not {count} numbers with commas between them')
    return numbers
