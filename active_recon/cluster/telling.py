"""Progress of work on many items, on one line."""

from collections.abc import Callable, Iterable, Iterator
import time
from typing import Any, TypeVar

from active_recon.cluster.crew import Crew
from active_recon.reporting import Advance

Found = TypeVar('Found')
_COUNT_EVERY = 2.0  # seconds between two looks at the number of workers


def _has_refusal(result: Any) -> bool:
    return bool(result.refusal)


def told(results: Iterable[Found], crew: Crew, advance: Advance,
         refused: Callable[[Found], bool] = _has_refusal) -> Iterator[Found]:
    """
    Pass results on, and report each with the rate, the workers and the refused items so far.

    By default those are refused whose `refusal` says why.
    """
    begun = time.monotonic()
    counted, workers = -_COUNT_EVERY, 0
    failures = 0
    for done, result in enumerate(results, 1):
        failures += refused(result)
        took = time.monotonic() - begun
        if took - counted >= _COUNT_EVERY:
            counted, workers = took, crew.workers
        advance(1, f'{done / max(took, 1e-9):.1f}/s, {workers} '
                   f'{"worker" if workers == 1 else "workers"}, {failures} refused')
        yield result
