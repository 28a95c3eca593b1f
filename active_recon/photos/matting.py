"""Masks by `rembg`, where that package is installed: networks that find what a photo is of."""

from functools import cache
from importlib import import_module
from typing import Any

from active_recon.errors import ConfigError, ViewError
import numpy as np
from numpy.typing import NDArray


def rembg_mask(image: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """
    Return the mask, (H, W), that rembg's default network finds in an image, (H, W, 3) uint8 RGB.

    Raises ConfigError where rembg is not installed or its network cannot be loaded, ViewError
    where it finds nothing.
    """
    rembg, session = _loaded()
    found = np.asarray(rembg.remove(image, session=session, only_mask=True)) > 127
    if not found.any():
        raise ViewError('no object: expected one that rembg tells from its background, found none',
                        'no_object')
    return found


@cache
def _loaded() -> tuple[Any, Any]:
    """Return the package and its network, which it downloads when it is first used."""
    try:
        rembg = import_module('rembg')
    except ImportError as error:
        raise ConfigError('background: rembg not usable: expected the package of that name, got: '
                          f'{error}; install it by: pip install "rembg[cpu]"') from error
    try:
        return rembg, rembg.new_session()
    except Exception as error:
        raise ConfigError('background: rembg not usable: expected its network, which it downloads '
                          f'when it is first used, got: {error!r}') from error
