"""The figures of doc/benchmarks.md, measured: `make bench`."""

import sys
from types import TracebackType

from active_recon.errors import ActiveReconError


def _in_one_line(kind: type[BaseException], error: BaseException,
                 trace: TracebackType | None) -> None:
    """End a benchmark that was given what it cannot use as a command ends: with the reason."""
    if issubclass(kind, ActiveReconError):
        sys.stderr.write(f'{error}\n')
    else:
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _in_one_line
