"""The command `active-recon`; subcommands import their modules when they run."""

from collections.abc import Callable
import gc
import inspect
import signal
import sys
from typing import Annotated, Any

from active_recon import __version__
from active_recon.cli.bag import bag
from active_recon.cli.batch import batch
from active_recon.cli.calibrate import calibrate
from active_recon.cli.camera import camera
from active_recon.cli.demo import demo
from active_recon.cli.evaluate import evaluate
from active_recon.cli.export import export
from active_recon.cli.making import dataset, render
from active_recon.cli.paper import paper
from active_recon.cli.play import play
from active_recon.cli.policies import policies
from active_recon.cli.quality import quality
from active_recon.cli.reconstruct import reconstruct
from active_recon.cli.record_sweep import record_sweep
from active_recon.cli.replay import replay
from active_recon.cli.report import report
from active_recon.cli.running_nodes import call, set_parameter, status
from active_recon.cli.sheet import sheet
from active_recon.cli.study import study
from active_recon.cli.train import train
from active_recon.cli.train_depth import train_depth
from active_recon.cli.train_policy import train_policy
from active_recon.cli.train_segmenter import train_segmenter
from active_recon.cli.up import up
from active_recon.cli.view import view
from active_recon.errors import ActiveReconError
from active_recon.interrupts import forget_interrupt, interrupt, is_interrupted, stop_signals
import typer

app = typer.Typer(
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
_OTHERWISE: dict[Callable[..., None], dict[str, Any]] = {
    # A negative number is a value, not an option
    set_parameter: {'name': 'set', 'context_settings': {'ignore_unknown_options': True}}}
for command in (demo, up, call, set_parameter, status, reconstruct, calibrate, camera, view,
                report, replay, play, record_sweep, render, train, train_policy, train_depth,
                train_segmenter, export, evaluate, study, policies, paper, sheet):
    app.command(**_OTHERWISE.get(command, {}))(command)
app.add_typer(dataset, name='dataset')
app.add_typer(bag, name='bag')
app.add_typer(batch, name='batch')
app.add_typer(quality, name='quality')


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f'active-recon {__version__}')
        raise typer.Exit


@app.callback()
def _any_command(
    version: Annotated[bool, typer.Option(
        '--version', callback=_print_version, is_eager=True, help='Show the version.')] = False,
) -> None:
    """Active 3D reconstruction of an object from few camera views."""


def _flow(commands: typer.Typer) -> None:
    """Let the terminal wrap the lines of help texts, but keep their paragraphs."""
    for each in commands.registered_commands:
        assert each.callback is not None
        each.help = flowing(each.callback)
    for group in commands.registered_groups:
        assert group.typer_instance is not None
        _flow(group.typer_instance)


def flowing(command: Callable[..., Any]) -> str:
    """Return a docstring with each of its paragraphs on one line."""
    paragraphs = (inspect.getdoc(command) or '').split('\n\n')
    return '\n\n'.join(' '.join(paragraph.split()) for paragraph in paragraphs)


_flow(app)


def main() -> None:
    """
    Run the command; errors of the package and of files are one line and exit code 2.

    `kill` and a terminal that is closed end it as Ctrl-C does: nothing unfinished stays.
    """
    for asked in stop_signals():
        # Of a shell's background, Ctrl-C is not for the command
        if asked != signal.SIGINT or signal.getsignal(asked) != signal.SIG_IGN:
            signal.signal(asked, interrupt)
    forget_interrupt()
    try:
        app()
    except KeyboardInterrupt:  # before typer, which builds all commands first, would take it
        sys.exit(130)
    except Exception as error:
        if is_interrupted():
            sys.exit(130)
        if not isinstance(error, (ActiveReconError, OSError)):
            raise
        typer.echo(f'active-recon: {error}', err=True)
        sys.exit(2)
    finally:
        # All that was imported ends with the process: looking through it takes 0.2 s
        gc.freeze()


if __name__ == '__main__':
    main()
