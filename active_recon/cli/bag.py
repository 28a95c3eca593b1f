"""`active-recon bag`: what is in a bag, and one that was cut off made whole."""

from pathlib import Path
from typing import Annotated

from active_recon.cli.bag_info import info
import typer

bag = typer.Typer(help='Recorded bags: look into them, repair them.', no_args_is_help=True)
bag.command()(info)


@bag.command()
def repair(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help="A bag's folder, or one of its MCAP files.")],
) -> None:
    """
    Make a bag whole whose recorder was killed, or whose disk was full.

    Index, summary and metadata.yaml are built anew from all that can be read. Nothing is thrown
    away: what is whole is not touched, and each file that had to be written anew is kept as it was
    as <name>.damaged beside it, which you may delete once you are content.

    Example: active-recon bag repair bags/2026-11-21_14-30-00
    """
    from active_recon.bags.storage.repair import bag_files, repair_bag
    from active_recon.cli.progress import progress_bar

    with progress_bar('repairing', len(bag_files(path))) as advance:
        repairs, described = repair_bag(path, lambda name: advance(1, name))
    for each in repairs:
        messages = f'{each.contents.counts.total()} messages'
        if each.kept_as is None:
            typer.echo(f'{each.path.name}: whole, {messages}')
        else:
            typer.echo(f'{each.path.name}: made whole, {messages}; kept as it was as '
                       f'{each.kept_as.name}')
        for loss in each.lost:
            typer.echo(f'{each.path.name}: could not be read: {loss}')
    if described:
        typer.echo('metadata.yaml: written')
