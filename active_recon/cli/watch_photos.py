"""`active-recon reconstruct --watch`: photos are taken in as they arrive, until Ctrl-C."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
import time
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from active_recon.photos.options import Options
    from active_recon.photos.shape import Shape
    from active_recon.photos.sources import Source
    from active_recon.policies.stopping import StoppingRule


@dataclass(frozen=True)
class Pages:
    """Where the pages are served: the live one's port, and whether a phone may send photos."""

    port: int
    lan: bool


def watch_photos(folder: Path, source: 'Source | None', options: 'Options',
                 stopping: 'StoppingRule', pages: Pages) -> 'Shape':
    """
    Serve both pages and take photos in until Ctrl-C; return the shape.

    Raises ActiveReconError where it cannot begin, or there is no shape at the end.
    """
    from active_recon.interrupts import held_interrupts
    from active_recon.viewer.address import HOST
    from active_recon.viewer.page import UPDATES_PER_S
    from active_recon.watching.advice import Adviser
    from active_recon.watching.collection import Collection
    from active_recon.watching.upload import lan_address, UploadServer
    from active_recon.watching.watch_page import WatchPage
    from active_recon.watching.watcher import Watcher

    host = lan_address() if pages.lan else HOST
    watcher = Watcher(folder, Collection(source, options),
                      Adviser(stopping, options.model, options.threads), typer.echo)
    upload = UploadServer(folder, lambda: watcher.progress, watcher.verdicts, host,
                          skip=watcher.skip)
    try:
        page = WatchPage(pages.port, upload.url if pages.lan else '')
        try:
            typer.echo(f'{folder} is watched until Ctrl-C, which writes the result')
            typer.echo(f'the shape and the next view: {page.url}')
            typer.echo(f'photos from {"a phone in this network" if pages.lan else "this machine"}:'
                       f' {upload.url}')
            with suppress(KeyboardInterrupt), held_interrupts() as raise_if_asked:
                while True:
                    raise_if_asked()
                    if page.skips():
                        watcher.skip()
                    watcher.step(time.monotonic())
                    page.draw(watcher.progress)
                    time.sleep(1 / UPDATES_PER_S)
        finally:
            page.close()
    finally:
        upload.close()
    return watcher.result()
