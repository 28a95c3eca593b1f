"""Shared memory that is large enough for the nodes' messages, unless the user chose its size."""

import os
from pathlib import Path

PROFILE = Path(__file__).with_name('fastdds_local.xml')
_CHOICES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE',
            'FASTDDS_BUILTIN_TRANSPORTS')
_CHOSEN_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')


def make_room() -> None:
    """
    Configure Fast DDS for whole point clouds; to be called before the first node is made.

    Its default of 512 KiB drops larger messages, together with others in the same buffer. A
    latched message that is lost can be resent only until the next one replaces it, so a recorder
    would miss some. A profile that the user has chosen is kept.
    """
    if not any(map(os.environ.get, _CHOICES)) and not any(map(os.path.exists, _CHOSEN_FILES)):
        os.environ[_CHOICES[0]] = str(PROFILE)
