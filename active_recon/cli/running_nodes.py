"""`active-recon call`, `set` and `status`: ask the running nodes, without the command `ros2`."""

from typing import Annotated, TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from active_recon.launching.running_nodes import NodeReading

_Namespace = Annotated[str, typer.Option(
    help='Namespace of the nodes, for a name that does not begin with a slash.')]
_Timeout = Annotated[float, typer.Option(
    min=0.1, help='Seconds after which what has not been found is missing; nodes of one machine '
                  'find each other within about 2.')]
_TIMEOUT_S = 5.0
_STYLES = {'OK': 'green', 'WARN': 'yellow'}
_LOG_WIDTH = 200  # without a terminal: a line for each value


def call(
    service: Annotated[str, typer.Argument(
        help='Name of the service: save_mesh, or with its namespace /cell/save_mesh.')],
    namespace: _Namespace = '',
    timeout: _Timeout = _TIMEOUT_S,
) -> None:
    """
    Call a service of the running nodes, and print its answer.

    The reconstructor has start_episode, save_mesh, save_state, load_state and capture_background;
    the planner plan, skip_goal and stop_episode; the recorder start and stop; the simulated
    turntable next_object. Services of the type std_srvs/srv/Trigger of other nodes can be called,
    too. The exit code is 1 if the service did not succeed. ROS_DOMAIN_ID must be that of the
    nodes.

    Example: active-recon call save_mesh
    """
    from active_recon.launching.running_nodes import running_nodes

    with running_nodes(namespace, timeout) as nodes:
        success, message = nodes.call(service)
    typer.echo(message or ('success' if success else 'no success'), err=not success)
    raise typer.Exit(0 if success else 1)


def set_parameter(
    node: Annotated[str, typer.Argument(
        help='Name of the node: view_planner, or with its namespace /cell/view_planner.')],
    parameter: Annotated[str, typer.Argument(help='Name of the parameter.')],
    value: Annotated[str, typer.Argument(help='The new value, in YAML.')],
    namespace: _Namespace = '',
    timeout: _Timeout = _TIMEOUT_S,
) -> None:
    """
    Set a parameter of a running node, and print its old and its new value.

    Where the node refuses the value, its reason is printed and the exit code is 1. The parameters
    that may change while a node runs are marked dynamic in doc/interfaces.md; the others are set
    where the node is started. ROS_DOMAIN_ID must be that of the nodes.

    Example: active-recon set view_planner target_quality 0.5

    Example: active-recon set view_planner azimuth_range "[-1.5, 2.2]"
    """
    from active_recon.launching.running_nodes import running_nodes
    from active_recon.parameters.value_text import text_from_value

    with running_nodes(namespace, timeout) as nodes:
        change = nodes.set_parameter(node, parameter, value)
    before, after = text_from_value(change.before), text_from_value(change.after)
    if change.refusal:
        typer.echo(f'{change.node}: {parameter} stays {before}: {change.refusal}', err=True)
        raise typer.Exit(1)
    typer.echo(f'{change.node}: {parameter} was {before}, is {after}')


def status(
    namespace: Annotated[str, typer.Option(
        help='Namespace of the nodes to show, as of one of several loops. Default: all nodes.'
    )] = '',
    timeout: _Timeout = _TIMEOUT_S,
) -> None:
    """
    Show the diagnostics of the running nodes, once.

    Each node has a level (OK, WARN or ERROR), a message that gives the reason, and values: keys
    in lower case count since the node's start, the others are current. doc/diagnostics.md explains
    them. Nodes that publish diagnostics and were not heard are named. ROS_DOMAIN_ID must be
    that of the nodes.

    Example: active-recon status

    Example: active-recon status --namespace cell_1
    """
    from active_recon.launching.running_nodes import running_nodes

    with running_nodes(namespace, timeout) as nodes:
        readings, silent = nodes.read_status()
    _show(readings)
    for name in silent:
        typer.echo(f'{name}  nothing heard in {timeout:g} s: it is busy, blocked, or has just '
                   'ended')


def _show(readings: 'list[NodeReading]') -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = _LOG_WIDTH
    for each in readings:
        heading = Text.assemble((each.name, 'bold'), '  ',
                                (each.level, _STYLES.get(each.level, 'red')), f'  {each.message}')
        console.print(heading, soft_wrap=True)
        table = Table(box=None, show_header=False, padding=(0, 1, 0, 2))
        table.add_column(style='dim', overflow='fold')
        table.add_column(overflow='fold')
        for key, value in each.values.items():
            table.add_row(Text(key), Text(value))
        console.print(table)
