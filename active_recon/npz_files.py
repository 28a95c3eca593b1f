"""Files of numpy arrays (.npz), which may be damaged anywhere."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def read_npz(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """
    Return the arrays of these names.

    Raises OSError where the file cannot be read, ValueError where it is damaged or lacks one.
    """
    with path.open('rb') as file:
        try:
            with np.load(file, allow_pickle=False) as stored:
                return {name: stored[name] for name in names}
        except OSError:
            raise
        except Exception as error:  # zipfile, zlib and numpy's reader of headers have many kinds
            raise ValueError(f'{type(error).__name__}: {error}') from error
