"""Memory that a start has used and freed, given back to the system."""

import ctypes


def give_back_freed_memory() -> None:
    """
    Give back what was freed, where the C library can: loading leaves some 30 MB of it.

    It takes milliseconds; to be called once a node has loaded what it needs.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)  # glibc's
    if trim is not None:
        trim(0)
