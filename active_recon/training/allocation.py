"""Memory that is freed and taken again in every step stays with the process."""

import ctypes

_TRIM_THRESHOLD, _TOP_PAD, _MMAP_MAX = -1, -2, -4  # of mallopt(3)
_NEVER, _AT_ONCE = 2 ** 31 - 1, 256 * 2 ** 20  # bytes


def keep_freed_memory() -> bool:
    """
    Tell glibc to keep freed memory instead of returning it; return whether it will.

    A training step allocates and frees gigabytes in large blocks, which glibc maps anew each time:
    the kernel's clearing of their pages took a fifth to a half of a step on the CPU. The process
    keeps the most that it ever needed, and the gaps between blocks of other sizes, until
    `give_back_freed_memory`. Without glibc nothing changes.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    return all([mallopt(_MMAP_MAX, 0), mallopt(_TRIM_THRESHOLD, _NEVER),
                mallopt(_TOP_PAD, _AT_ONCE)])
