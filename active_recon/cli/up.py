"""`active-recon up`: the nodes of a parameters file, where launch is missing."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class LogLevel(StrEnum):
    """From how grave on a node says what it does."""

    debug = 'debug'
    info = 'info'
    warn = 'warn'
    error = 'error'
    fatal = 'fatal'


def up(
    params: Annotated[Path, typer.Option(
        help='A ROS parameters file; the nodes that it names are started.')],
    namespace: Annotated[str, typer.Option(
        help='The namespace of the nodes and of all their topics.')] = '',
    remap: Annotated[list[str] | None, typer.Option(
        '--remap', '-r', metavar='FROM:=TO', help='Another name for a topic; may be repeated.',
    )] = None,
    log_level: Annotated[LogLevel, typer.Option(
        help='From how grave on the nodes say what they do.')] = LogLevel.info,
) -> None:
    """
    Start the nodes of a parameters file together, and stop them together on Ctrl-C.

    It does what the launch files do, on a machine without ros2 launch. Where a node ends by
    itself, the others are stopped and the command ends with an error.

    Example: active-recon up --params config/arm.yaml -r camera/image_raw:=/wrist/image_raw
    """
    from active_recon.launching.up import run_up, Start

    run_up(Start(params, namespace, remap or (), log_level.value), typer.echo)
