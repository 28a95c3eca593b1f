"""`active-recon up`: start the nodes of a parameters file, without ros2 launch."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class LogLevel(StrEnum):
    """The lowest severity that nodes log."""

    debug = 'debug'
    info = 'info'
    warn = 'warn'
    error = 'error'
    fatal = 'fatal'


def up(
    params: Annotated[Path, typer.Option(
        help='ROS parameters file; all nodes in it are started.')],
    namespace: Annotated[str, typer.Option(
        help='Namespace of the nodes and their topics.')] = '',
    remap: Annotated[list[str] | None, typer.Option(
        '--remap', '-r', metavar='FROM:=TO', help='Remap a topic; may be repeated.',
    )] = None,
    log_level: Annotated[LogLevel, typer.Option(
        help='Lowest severity that the nodes log.')] = LogLevel.info,
    single_process: Annotated[bool, typer.Option(
        '--single-process', help='Run reconstructor, planner and simulated camera in one process: '
        'less memory, less time for their messages.')] = False,
) -> None:
    """
    Start the nodes of a parameters file, and stop them on Ctrl-C.

    An alternative to the launch files on a machine without ros2 launch. If a node exits by itself,
    the others are stopped and the command fails.

    Example: active-recon up --params config/arm.yaml -r camera/image_raw:=/wrist/image_raw
    """
    from active_recon.launching.up import run_up, Start

    run_up(Start(params, namespace, remap or (), log_level.value, single_process),
           typer.echo)
