"""What workers do in the tests of clusters: functions that their processes import."""

import os
from pathlib import Path
import signal
import sys
import time

from active_recon.errors import DataError, WorkError
from active_recon.whole_files import whole_file


def halved(number):
    """Return half of an even number; refuse 3, fail at 5."""
    if number == 3:
        raise DataError('3: odd: expected an even number')
    if number == 5:
        raise ZeroDivisionError('5 is a fault of the program')
    return number / 2


def dying(folder, number):
    """Tell in a folder that an item was begun; die at the first try of 2, and at each of 5."""
    begun = len(list(Path(folder).glob(f'{number}-*')))
    (Path(folder) / f'{number}-{begun}').touch()
    if number == 5 or (number == 2 and not begun):
        os.kill(os.getpid(), 9)
    return number


class Panic(BaseException):
    """As libraries in Rust raise: no Exception."""


def ending(number):
    """Ask the process to end at 1, panic at 2; return what was given."""
    if number == 1:
        sys.exit('of a parser')
    if number == 2:
        raise Panic('of a library')
    return number


def signalled(kind):
    """Get a signal, as all processes of a terminal do; return which."""
    os.kill(os.getpid(), kind)
    return kind


class InterruptedAtStart:
    """What gets Ctrl-C in a worker that still imports it."""

    def __call__(self, number):
        return number

    def __reduce__(self):
        return _interrupted, ()


def _interrupted():
    os.kill(os.getpid(), signal.SIGINT)
    return InterruptedAtStart()


def slowly(folder, number):
    """Take a tenth of a second, and tell in a folder that the item was done by which process."""
    time.sleep(0.1)
    (Path(folder) / f'{number}-{os.getpid()}').touch()
    return os.getpid()


def for_ever_but_the_first(folder, number):
    """Return 0 once 1 is begun; begin to write a file of the others, and never end."""
    if number == 0:
        while not list(Path(folder).glob('.1.*')):
            time.sleep(0.01)
        return 0
    with whole_file(Path(folder) / str(number)) as unfinished:
        unfinished.touch()
        time.sleep(600)
    return number


def quick_at_first(number):
    """Take no time before 40, and then a fifth of a second; return what was given."""
    time.sleep(0.2 * (number >= 40))
    return number


def without_room(number):
    """Fail as on a full disk."""
    raise OSError(28, 'No space left on device', f'/full/{number}')


def that_stops(number):
    """Stop all work at 2."""
    if number == 2:
        raise WorkError('2: not seen', 'not_seen')
    return number
