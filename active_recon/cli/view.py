"""`active-recon view`: the loop in the browser, live or from a bag."""

import os
from pathlib import Path
import sys
from typing import Annotated

from active_recon.viewer.address import DEFAULT_PORT, HIGHEST_PORT
import typer


def view(
    bag: Annotated[Path | None, typer.Argument(
        help='A bag to step through; without one, the loop that runs on this ROS domain.')] = None,
    port: Annotated[int, typer.Option(
        min=0, max=HIGHEST_PORT, help='Where the page is served, or at the next port that is '
                                      'free, which is told; 0 for any.')] = DEFAULT_PORT,
) -> None:
    """
    Show the loop in the browser, on a page of this machine alone.

    The object as it takes shape, the views taken, where the camera goes next and why. The page
    may be opened late, twice, or closed: the loop does not notice. Ctrl-C ends it.

    For example: active-recon view, or active-recon view bags/2026-11-21_10-00-00
    """
    if bag is None:
        # The node takes this process's place, and so hears its Ctrl-C
        os.execv(sys.executable, [sys.executable, '-m', 'active_recon.nodes.viewer',
                                  '--ros-args', '-p', f'port:={port}'])
    raise NotImplementedError
