"""Exported networks on disk: one ONNX file for each part, each of which says what it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

from active_recon.errors import WeightsError
from active_recon.json_text import json_value
from active_recon.models.weights_files import SHIPPED

FORMAT = 2  # in 1 the update also gave what it had summed up for the decoder
KEY = 'active_recon'
"""The key of a file's metadata, JSON text, among those of ONNX."""
NEXT = 'next_'
"""What the name of a part of the state begins with where it is an output."""
NETWORK_PARTS, POLICY_PART, DEPTH_PART = ('encode', 'update', 'decode'), 'policy', 'depth'
SEGMENT_PART = 'segment'
"""The segmenter, which goes with no other weights than its own."""
DECODE_PART, INT8_PART = 'decode', 'decode-int8'
"""The decoder, and what takes its place in the precision int8."""


@dataclass(frozen=True)
class GraphMetadata:
    """
    What an exported file says of itself.

    - part: one of NETWORK_PARTS, INT8_PART, POLICY_PART, DEPTH_PART or SEGMENT_PART
    - weights_sha256: of the weights file whose network it is, or with which the part goes
    - state: the shape of each named array, without the axis of objects, and the value that all of
      it has before the first view
    - facts: of a network `model`, `threshold`, `image_size`, `resolution`, `needs_front` and
      `config_sha256`; of a policy, those of its model, and its `policy_sha256`; of a depth
      refiner its `depth_sha256`; of a segmenter its `image_size`
    """

    part: str
    weights_sha256: str
    state: Mapping[str, tuple[Sequence[int], float]]
    facts: Mapping[str, Any]

    def to_json(self) -> str:
        """Return the metadata as they are written."""
        return json.dumps({'format': FORMAT, 'part': self.part,
                           'weights_sha256': self.weights_sha256, 'state': self.state,
                           'facts': self.facts}, sort_keys=True)


def graph_path(weights: Path | None, part: str, folder: Path | None = None) -> Path:
    """Return where a part of exported weights lies: beside them, or in another folder."""
    weights = weights or SHIPPED
    return (folder or weights.parent) / f'{weights.stem}-{part}.onnx'


def is_exported(weights: Path | None, parts: Sequence[str] = NETWORK_PARTS) -> bool:
    """Return whether there are files of all the parts beside weights, whatever is in them."""
    return all(graph_path(weights, part).is_file() for part in parts)


def read_graph_metadata(path: Path, text: str | None, part: str,
                        weights_sha256: str) -> GraphMetadata:
    """
    Return the metadata of an exported file by their text, None where it has none.

    Raises WeightsError where they are not those of a part of the weights of a hash, or are of a
    format that is not known here.
    """
    if text is None:
        raise WeightsError(f'{path}: says nothing of active_recon: expected a file that '
                           '`active-recon export` wrote')
    try:
        told = json_value(text)
        if told['format'] != FORMAT:
            raise WeightsError(f'{path}: another format of exported files: expected {FORMAT}, got '
                               f'{told["format"]}; export the weights anew, or update this '
                               'package')
        found = GraphMetadata(
            told['part'], told['weights_sha256'],
            {name: (tuple(map(int, shape)), float(value))
             for name, (shape, value) in told['state'].items()}, dict(told['facts']))
    except (ValueError, KeyError, OverflowError, TypeError, AttributeError) as error:
        raise WeightsError(f'{path}: its metadata cannot be read: {error!r}') from error
    if found.part != part:
        raise WeightsError(f'{path}: another part of a network: expected {part}, got {found.part}')
    if found.weights_sha256 != weights_sha256:
        raise WeightsError(f'{path}: exported from other weights: expected {weights_sha256[:12]}, '
                           f'got {found.weights_sha256[:12]}; export them by `active-recon '
                           'export`')
    return found


def require_shapes(path: Path, told: GraphMetadata, inputs: Mapping[str, Sequence[int | None]],
                   outputs: Sequence[str], leading: int) -> None:
    """
    Raise WeightsError where a graph contradicts its metadata.

    Takes the shapes of its inputs by name, None where any length is taken, its outputs' names, and
    how many axes stand before those of the metadata.
    """
    if told.part not in ('update', POLICY_PART):
        return
    for name, (shape, _) in told.state.items():
        own = tuple(inputs[name][leading:]) if name in inputs else tuple(shape)  # it may be unused
        if own != tuple(shape) or NEXT + name not in outputs:
            raise WeightsError(f'{path}: contradicts its metadata: expected the state {name} of '
                               f'{tuple(shape)} as input and output, got '
                               f'{own if NEXT + name in outputs else "no such output"}')
