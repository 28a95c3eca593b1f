"""Weights files by name, hash and card, without reading a network."""

from dataclasses import dataclass
from functools import lru_cache
import hashlib
import json
from pathlib import Path
from typing import Any

from active_recon.config import Config, with_current_keys
from active_recon.errors import WeightsError
from active_recon.json_text import json_value
from safetensors import safe_open, SafetensorError

DEFAULT_MODEL, PAPER_MODEL = 'lifting-large', '2d3d-attention'
SMALL_MODEL = 'lifting'
"""The default with a third of its parameters: it knows less, and is faster."""
FOLDER = Path(__file__).parents[1] / 'weights'
SCORER = '-scorer'
"""What the name of a network's weights is followed by in that of its view policy's."""
DEPTH = '-depth'
"""Likewise of the depth refiner's."""
SEGMENTER = FOLDER / 'segmenter.safetensors'
"""The segmenter that ships: it is no reconstruction network, and serves all of them."""
SHIPPED = FOLDER / f'{DEFAULT_MODEL}.safetensors'


@dataclass(frozen=True)
class WeightsMetadata:
    """What a weights file says of itself: the network's name, its sizes, and the threshold."""

    model: str
    config: dict[str, Any]
    threshold: float


def read_metadata(path: Path) -> WeightsMetadata:
    """Return what a weights file says of itself; raises WeightsError where it is not whole."""
    if not path.is_file():
        raise WeightsError(f'{path}: no such file: expected weights (.safetensors)')
    try:
        with safe_open(path, framework='np') as stored:
            metadata = stored.metadata() or {}
    except (SafetensorError, OSError) as error:
        raise WeightsError(f'{path}: no whole safetensors file: {error}') from error
    if 'model' not in metadata:
        raise WeightsError(f'{path}: names no model: expected weights of one of the networks')
    if 'threshold' not in metadata:
        raise WeightsError(f'{path}: its config cannot be read: expected that of a reconstruction '
                           f'network, with a threshold, got that of a {metadata["model"]}')
    try:
        config, threshold = dict(json_value(metadata['config'])), float(metadata['threshold'])
        if not 0 <= threshold <= 1:
            raise ValueError(f'expected a threshold from 0 to 1, got {threshold}')
        return WeightsMetadata(metadata['model'], config, threshold)
    except (KeyError, ValueError, TypeError) as error:
        raise WeightsError(f'{path}: its config cannot be read: {error}') from error


def find_weights(model: str | Path | None = None) -> Path:
    """
    Return the weights file of a model's name, or of a path; None is the default's.

    Raises WeightsError where a name is meant whose weights do not ship.
    """
    if model is None:
        return SHIPPED
    path = Path(model)
    if path.suffix == '.safetensors' or len(path.parts) > 1:
        return path
    shipped = FOLDER / f'{model}.safetensors'
    if not shipped.is_file():
        names = ', '.join(sorted(file.stem for file in FOLDER.glob('*.safetensors')
                                 if not file.stem.endswith((SCORER, DEPTH))
                                 and file != SEGMENTER))
        raise WeightsError(f'{model}: neither a weights file (.safetensors) nor a model whose '
                           f'weights ship ({names}); `active-recon train` makes weights')
    return shipped


def scorer_path(weights: Path | None = None) -> Path:
    """Return where the scorer of a network's weights lies; None: of those that ship."""
    weights = weights or SHIPPED
    return weights.with_name(f'{weights.stem}{SCORER}.safetensors')


def depth_path(weights: Path | None = None) -> Path:
    """Return where the depth refiner of a network's weights lies; None: of those that ship."""
    weights = weights or SHIPPED
    return weights.with_name(f'{weights.stem}{DEPTH}.safetensors')


def read_card(path: Path) -> dict[str, Any]:
    """Return the card beside weights, with current keys; empty where there is none."""
    beside = path.with_suffix('.json')
    try:
        return with_current_keys(dict(json_value(beside.read_text()))) if beside.is_file() else {}
    except (OSError, ValueError, TypeError) as error:
        raise WeightsError(f'{beside}: no readable card: expected the JSON that was written '
                           f'beside {path.name}, got: {error}') from error


def weights_hash(path: Path | None = None) -> str:
    """Return the SHA-256 of a weights file; None is the one that ships. Raises WeightsError."""
    path = path or SHIPPED
    try:
        file = path.stat()
        return _file_hash(path, file.st_ino, file.st_size, file.st_mtime_ns, file.st_ctime_ns)
    except OSError as error:
        raise WeightsError(f'{path}: cannot be read: expected weights (.safetensors), got: '
                           f'{error.strerror}') from error


@lru_cache(64)
def _file_hash(path: Path, *_identity: int) -> str:
    """Return the SHA-256 of a file, read anew once it is another: a start asks four times."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def config_hash(config: Config | dict[str, Any]) -> str:
    """Return the SHA-256 of a network's sizes."""
    sizes = config.to_dict() if isinstance(config, Config) else config
    return hashlib.sha256(json.dumps(sizes, sort_keys=True).encode()).hexdigest()
