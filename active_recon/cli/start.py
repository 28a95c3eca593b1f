"""The beginning of the command `active-recon`: for half a second it imports what it needs."""

import signal


def main() -> None:
    """Run the command; Ctrl-C while it is still imported ends it at once, without a traceback."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from active_recon.cli.main import main as run

    run()
