"""What became of an item: its value, or why it was refused."""

from collections.abc import Callable
from dataclasses import dataclass
import errno
from typing import Any

from active_recon.errors import ActiveReconError, WorkError

ATTEMPTS = 3
"""How often an item is begun whose worker dies; then it is refused."""
WORKER_DIED = 'worker_died'
FILE = 'file'
UNEXPECTED = 'unexpected'
_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}


@dataclass(frozen=True)
class Result:
    """
    The result of the item with this index.

    - value: what the function returned; None where the item was refused
    - refusal: why there is no value; '' where there is one
    - kind: the error's kind, a short stable word; '' where there is a value
    """

    index: int
    value: Any = None
    refusal: str = ''
    kind: str = ''


@dataclass(frozen=True)
class Outcome:
    """What a worker tells of an item; `stop`: all the work must stop for this reason."""

    value: Any = None
    refusal: str = ''
    kind: str = ''
    stop: bool = False

    def result(self, index: int) -> Result:
        """Return the result of the item; raises WorkError where the work must stop."""
        if self.stop:
            raise WorkError(self.refusal, self.kind)
        return Result(index, self.value, self.refusal, self.kind)


DIED = Outcome(refusal=f'its worker died {ATTEMPTS} times: expected a result, got none',
               kind=WORKER_DIED)


def attempt(function: Callable[[Any], Any], item: Any) -> Outcome:
    """
    Call the function; what it raises becomes a refusal, so that no item stops another.

    A WorkError and a disk without room concern all items: they stop the work.
    """
    try:
        return Outcome(function(item))
    except WorkError as error:
        return Outcome(refusal=str(error), kind=error.kind, stop=True)
    except ActiveReconError as error:
        return _no_room(error) if is_no_room(error) else Outcome(
            refusal=str(error), kind=error.kind)
    except OSError as error:
        return _no_room(error) if is_no_room(error) else Outcome(
            refusal=f'cannot be read or written: {error}', kind=FILE)
    except (KeyboardInterrupt, SystemExit):  # the latter is how Ray ends its workers
        raise
    except BaseException as error:  # an archive outlives a fault that only one of its items shows
        return Outcome(refusal=f'{type(error).__name__}: {error}', kind=UNEXPECTED)


def is_no_room(error: BaseException | None) -> bool:
    """Return whether an error, or what caused it, says that nothing can be written any more."""
    return error is not None and (
        isinstance(error, OSError) and error.errno in _NO_ROOM or is_no_room(error.__cause__))


def _no_room(error: Exception) -> Outcome:
    return Outcome(refusal=f'no room to write: {error}; what is finished is kept: start again '
                           'once there is room', kind='no_room', stop=True)
