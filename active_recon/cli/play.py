"""`active-recon play`: publish a bag's messages to running nodes."""

import json
import os
from pathlib import Path
import sys
from typing import Annotated

from active_recon.cli.progress import bag_progress
import typer


def play(
    bag: Annotated[Path, typer.Argument(help='A rosbag2 folder, or an MCAP or sqlite3 file.')],
    rate: Annotated[float, typer.Option(
        help='Playback speed, above 0; 1 is the speed of the recording.')] = 1.0,
    topics: Annotated[str, typer.Option(
        metavar='NAME,NAME,...', help='Topics to play. Default: all of the bag.')] = '',
) -> None:
    """
    Publish a bag's messages to running nodes, at the times at which they were received.

    Topics are published with their recorded QoS, and the bag's time on /clock. The nodes need
    `use_sim_time`, since the recording is older than they are. Play only the camera's topics to
    run the nodes as with a live camera.

    Example: active-recon play bags/2026-11-21_14-30-00 --rate 2
    --topics camera/image_raw,camera/camera_info,camera/pose
    """
    from active_recon.bags.runs.playing import played

    played(bag, rate, topics, bag_progress(bag))
    # The node replaces this process and receives its Ctrl-C
    os.execv(sys.executable, [
        sys.executable, '-m', 'active_recon.nodes.player', '--ros-args',
        '-p', _parameter('bag', str(bag)), '-p', f'rate:={rate}',
        '-p', _parameter('topics', topics)])


def _parameter(name: str, value: str) -> str:
    """Return a parameter in ROS's YAML, of which JSON is a part."""
    return f'{name}:={json.dumps(value, ensure_ascii=False)}'

