"""`active-recon play`: a bag's messages to nodes that are live."""

import os
from pathlib import Path
import sys
from typing import Annotated

from active_recon.cli.progress import bag_progress
import typer


def play(
    bag: Annotated[Path, typer.Argument(help="A bag's folder, or one of its MCAP files.")],
    rate: Annotated[float, typer.Option(
        help='How much faster than it was recorded: above 0.')] = 1.0,
    topics: Annotated[str, typer.Option(
        metavar='NAME,NAME,...', help='Those to play. Default: all of the bag.')] = '',
) -> None:
    """
    Publish a bag's messages to live nodes, as and when they were received.

    Topics are offered with the QoS they were recorded with, and the bag's time goes out on
    /clock. Nodes that hear the recording need `use_sim_time`, since its images are older than
    they are; give them the inputs alone, and they do not know it from a camera.

    Example: active-recon play bags/2026-11-21_14-30-00 --rate 2
    --topics camera/image_raw,camera/camera_info,camera/pose
    """
    from active_recon.bags.runs.playing import played_topics

    played_topics(bag, rate, topics, bag_progress(bag))
    # The node takes this process's place, and so hears its Ctrl-C
    os.execv(sys.executable, [
        sys.executable, '-m', 'active_recon.nodes.player', '--ros-args', '-p', f'bag:="{bag}"',
        '-p', f'rate:={rate}', '-p', f'topics:="{topics}"'])

