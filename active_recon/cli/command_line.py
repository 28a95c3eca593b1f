"""The command that runs, as results and cards keep it."""

import shlex
import sys


def command_line() -> str:
    """Return the command with its arguments, as a shell takes it."""
    return shlex.join(['active-recon', *sys.argv[1:]])
