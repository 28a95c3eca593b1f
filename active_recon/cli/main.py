"""The command `active-recon`; what a subcommand needs is imported when it runs."""

import sys

from active_recon.cli.bag import bag
from active_recon.cli.calibrate import calibrate
from active_recon.cli.demo import demo
from active_recon.cli.evaluate import evaluate
from active_recon.cli.making import dataset, render
from active_recon.cli.paper import paper
from active_recon.cli.play import play
from active_recon.cli.record_sweep import record_sweep
from active_recon.cli.replay import replay
from active_recon.cli.report import report
from active_recon.cli.sheet import sheet
from active_recon.cli.study import study
from active_recon.cli.train import train
from active_recon.cli.up import up
from active_recon.cli.view import view
from active_recon.errors import ActiveReconError
import typer

app = typer.Typer(
    help='Active 3D reconstruction of an object from few camera views.',
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
for command in (demo, up, calibrate, view, report, replay, play, record_sweep, render, train,
                evaluate, study, paper, sheet):
    app.command()(command)
app.add_typer(dataset, name='dataset')
app.add_typer(bag, name='bag')


def main() -> None:
    """Run the command; what the package refuses is one line and exit code 2."""
    try:
        app()
    except ActiveReconError as error:
        sys.stderr.write(f'active-recon: {error}\n')
        sys.exit(2)


if __name__ == '__main__':
    main()
