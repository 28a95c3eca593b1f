"""Room in shared memory for what the nodes send, where nobody has chosen it."""

import os
from pathlib import Path

PROFILE = Path(__file__).with_name('fastdds_local.xml')
_CHOICES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE',
            'FASTDDS_BUILTIN_TRANSPORTS')
_CHOSEN_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def make_room() -> None:
    """
    Have Fast DDS hold whole clouds of cells, before its first node is made.

    By default it holds 512 KiB, and what does not fit is dropped with whatever waits beside it. A
    latched message that is lost so can be sent again only until the next one takes its place, so
    who records misses one now and then. A profile that the user has chosen stays.
    """
    if not any(map(os.environ.get, _CHOICES)) and not any(map(os.path.exists, _CHOSEN_FILES)):
        os.environ[_CHOICES[0]] = str(PROFILE)
