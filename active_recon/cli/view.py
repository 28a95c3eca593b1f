"""`active-recon view`: the loop in the browser, live or from a bag."""

from contextlib import suppress
import os
from pathlib import Path
import sys
import time
from typing import Annotated, TYPE_CHECKING

from active_recon.cli.bag_options import bag_options_given, with_bag_options
from active_recon.errors import ConfigError
from active_recon.parameters.viewer import DEFAULT_PORT, HIGHEST_PORT
import typer

if TYPE_CHECKING:
    from active_recon.bags.runs.scene import Scene
    from active_recon.bags.runs.topics import Topics


@with_bag_options
def view(
    topics: 'Topics',
    scene: 'Scene',
    bag: Annotated[Path | None, typer.Argument(
        help='Bag to step through. Default: the loop that runs on this ROS domain.')] = None,
    port: Annotated[int, typer.Option(
        min=0, max=HIGHEST_PORT, help='Port of the page; if it is taken, the next free one, which '
                                      'is printed. 0 chooses any.')] = DEFAULT_PORT,
    remap: Annotated[list[str] | None, typer.Option(
        '--remap', '-r', metavar='FROM:=TO',
        help='Remap a topic of the running loop, or set its namespace with __ns:=/NAME; '
             'may be repeated.')] = None,
) -> None:
    """
    Show the loop in the browser, on a page that only this machine can open.

    It shows the reconstruction, the views taken, the next view and the scores of the candidates.
    The page can be opened late, opened several times, or closed without any effect on the loop.
    Ctrl-C ends it. The object's size and frame and the topic names are read from the running
    nodes.

    Example: active-recon view

    Example: active-recon view bags/2026-11-21_10-00-00
    """
    if bag is not None and remap:
        raise ConfigError('--remap with a bag: it is for the topics of a running loop; those of a '
                          'bag are named by --image and its like')
    if bag is None:
        if ignored := bag_options_given(topics, scene) - {'--object-size'}:
            raise ConfigError(f'{", ".join(sorted(ignored))} without a bag: they are for a bag; '
                              "a running loop's nodes have their own parameters, and --remap "
                              'renames topics')
        # The node replaces this process and receives its Ctrl-C
        size = [] if scene.object_size is None else ['-p', f'object_size:={scene.object_size}']
        names = [word for each in remap or () for word in ('-r', each)]
        os.execv(sys.executable, [sys.executable, '-m', 'active_recon.nodes.viewer', '--ros-args',
                                  '-p', f'port:={port}', *size, *names])
    _step_through(bag, topics, scene, port)


def _step_through(bag: Path, topics: 'Topics', scene: 'Scene', port: int) -> None:
    from active_recon.bags.runs.reading import read_run
    from active_recon.bags.runs.rebuilt import rebuilt
    from active_recon.interrupts import held_interrupts
    from active_recon.viewer.page import UPDATES_PER_S
    from active_recon.viewer.playback import Playback

    run, made_by = rebuilt(read_run(bag, topics, scene), scene)
    if made_by:
        typer.echo('the bag has no reconstructions: those shown are computed from its images by '
                   f'{made_by}')
    playback = Playback(run, port)
    try:
        typer.echo(f'{bag} is shown at {playback.page.url} until Ctrl-C')
        with suppress(KeyboardInterrupt), held_interrupts() as raise_if_asked:
            while True:
                raise_if_asked()
                playback.draw(time.monotonic())
                time.sleep(1 / UPDATES_PER_S)
    finally:
        playback.page.close()
