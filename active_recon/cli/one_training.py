"""What commands of a single training share: its checkpoint, and its progress."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from active_recon.cli.progress import progress_bar
from active_recon.errors import ConfigError
from active_recon.reporting import by_step
from active_recon.whole_files import writable
import typer


def checkpoint_in(out: Path, resume: bool) -> Path:
    """
    Return where a training's checkpoint lies.

    Raises ConfigError on another training's, and where none can be written.
    """
    checkpoint = out / 'checkpoint.safetensors'
    if checkpoint.exists() and not resume:
        raise ConfigError(f'{out}: holds another training ({checkpoint.name}); continue it with '
                          '--resume, or name another folder with --out')
    return writable(checkpoint)


@contextmanager
def resumable(tells: bool) -> Iterator[None]:
    """
    Tell how to go on where a training, or what comes after its steps, is stopped.

    Of its processes one alone `tells`.
    """
    try:
        yield
    except KeyboardInterrupt as stopped:  # one of a step tells which
        if tells:
            typer.echo(str(stopped) or 'stopped; continue with --resume')
        raise typer.Exit(130) from None


@contextmanager
def shown_steps(title: str, steps: int) -> Iterator[Callable[[int, dict[str, float]], None]]:
    """Yield the report of a training, which takes each step and what was measured."""
    with progress_bar(title, steps) as advance:
        reached = by_step(advance)

        def report(step: int, measured: dict[str, float]) -> None:
            reached(step, '  '.join(f'{name} {value:.4f}'
                                    for name, value in measured.items()))

        yield report
