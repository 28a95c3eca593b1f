"""The options for the workers of a command: processes of this machine, or a Ray cluster."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
import re
from typing import Annotated

from active_recon.cluster import Crew, crew_of
from active_recon.errors import ConfigError
import typer

Cluster = Annotated[str | None, typer.Option(
    metavar='ADDRESS', help="Ray cluster that does the work: 'auto' (the Ray of RAY_ADDRESS, else "
                            "the one that runs on this machine), 'HOST:PORT', 'ray://HOST:PORT', "
                            "or 'local' (starts a Ray here). Paths must be on storage that its "
                            'machines share. Default: processes of this machine.')]
Workers = Annotated[int | None, typer.Option(
    min=1, help='Processes; default: one for each core, of this machine or of the cluster.')]

ClusterWorkers = Annotated[int | None, typer.Option(
    min=1, help='With --cluster: so many workers; default: one for each of its cores.')]


def require_cluster(cluster: str | None, workers: int | None) -> None:
    """Raise ConfigError where workers are asked for without a cluster."""
    if workers and not cluster:
        raise ConfigError('--workers: no cluster: expected --cluster too, got --workers '
                          f'{workers} alone')


@contextmanager
def workers_of(cluster: str | None, workers: int | None) -> Iterator[Crew]:
    """Yield the workers; print where their dashboard is, if any, and where there are none yet."""
    with crew_of(cluster, workers) as crew:
        if crew.dashboard:
            typer.echo(f'dashboard of Ray: {crew.dashboard}', err=True)
        if not crew.workers:
            typer.echo(f'--cluster: no CPUs at {cluster}: the work begins once a machine joins '
                       '(`ray start --address HOST:PORT`)', err=True)
        yield crew


def reachable(path: Path, cluster: str | None) -> Path:
    """
    Return a path as workers take it: absolute for those of a cluster, which begin elsewhere.

    Raises ConfigError on a URL.
    """
    return require_path(path) if cluster is None else require_path(path).absolute()


def require_path(path: Path) -> Path:
    """Return a path; raises ConfigError on a URL, which only `active-recon batch` takes."""
    if re.match(r'[A-Za-z][A-Za-z0-9+.-]+:/', str(path)):
        raise ConfigError(f'{path}: no path: expected a folder that all machines see, got a URL; '
                          'mount the store, for example with s3fs, gcsfuse or rclone')
    return path
