"""What a page contains instead of fetching it."""

from base64 import b64encode
from functools import cache
import gzip
from pathlib import Path

import plotly

_PLOTLY = Path(plotly.__file__).parent / 'package_data' / 'plotly.min.js'


def compressed(raw: bytes) -> str:
    """Return bytes as base64 of gzip, without gzip's time stamp."""
    return b64encode(gzip.compress(raw, 9, mtime=0)).decode()


@cache
def plotly_script() -> str:
    """Return Plotly as `compressed` does."""
    return compressed(_PLOTLY.read_bytes())
