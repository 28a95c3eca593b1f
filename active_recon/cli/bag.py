"""`active-recon bag`: shows the content of bags and repairs them."""

from pathlib import Path
from typing import Annotated

from active_recon.cli.bag_info import info
import typer

bag = typer.Typer(help='Recorded bags: show their content, repair them.', no_args_is_help=True)
bag.command()(info)


@bag.command()
def repair(
    path: Annotated[Path, typer.Argument(
        metavar='BAG', help="A bag's folder, or one of its MCAP files.")],
) -> None:
    """
    Repair a bag whose recorder was killed, or whose disk was full.

    Index, summary and metadata.yaml are rebuilt from all that can be read. Nothing is lost: intact
    files are left unchanged, and the original of each repaired file is kept as <name>.damaged next
    to it, until you delete it.

    Example: active-recon bag repair bags/2026-11-21_14-30-00
    """
    from active_recon.bags.storage.repair import bag_files, repair_bag
    from active_recon.cli.progress import progress_bar

    with progress_bar('repairing', len(bag_files(path))) as advance:
        repairs, described = repair_bag(path, lambda name: advance(1, name))
    for each in repairs:
        messages = f'{each.contents.counts.total()} messages'
        if each.kept_as is None:
            typer.echo(f'{each.path.name}: intact, {messages}')
        else:
            typer.echo(f'{each.path.name}: repaired, {messages}; original kept as '
                       f'{each.kept_as.name}')
        for loss in each.lost:
            typer.echo(f'{each.path.name}: could not be read: {loss}')
    if described:
        typer.echo('metadata.yaml: written')
