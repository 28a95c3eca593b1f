"""The options by which a command finds the camera's topics in other people's bags."""

from collections.abc import Callable
from functools import wraps
import inspect
from typing import Annotated, Any

import typer

_PANEL = "Other people's bags"
_OPTIONS: dict[str, tuple[Any, Any]] = {
    'image': (Annotated[str, typer.Option(
        rich_help_panel=_PANEL, metavar='TOPIC',
        help='Image or CompressedImage.')], ''),
    'camera_info': (Annotated[str, typer.Option(
        rich_help_panel=_PANEL, metavar='TOPIC', help='CameraInfo.')], ''),
    'azimuth': (Annotated[str, typer.Option(
        rich_help_panel=_PANEL, metavar='TOPIC',
        help="PoseStamped of the camera; or its azimuth, radians, as a turntable's JointState or "
             'a Float64.')], ''),
    'joint': (Annotated[str, typer.Option(
        rich_help_panel=_PANEL, metavar='NAME', help='Of the JointState, if it has several.')],
        ''),
    'turned_object': (Annotated[bool, typer.Option(
        '--turned-object', rich_help_panel=_PANEL,
        help='The azimuth is that of the turntable under a fixed camera.')], False),
    'object_frame': (Annotated[str, typer.Option(
        rich_help_panel=_PANEL, metavar='FRAME', help='Frame of the PoseStamped.')], 'object'),
    'max_pose_gap': (Annotated[float, typer.Option(
        rich_help_panel=_PANEL, min=0, metavar='SECONDS',
        help='From an image to the poses that its own lies between.')], 0.1),
}


def with_topics(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command its parameter `topics` from options of its command line."""
    own = inspect.signature(command).parameters

    @wraps(command)
    def run(**values: Any) -> None:
        from active_recon.bags.topics import Topics

        topics = Topics(**{name: values.pop(name) for name in _OPTIONS})
        command(**values, topics=topics)

    options = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default,
                                 annotation=annotation)
               for name, (annotation, default) in _OPTIONS.items()]
    parameters = [*(each for name, each in own.items() if name != 'topics'), *options]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {each.name: each.annotation for each in parameters}
    return run
