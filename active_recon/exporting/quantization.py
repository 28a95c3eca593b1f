"""The decoder of exported weights in 8-bit integers, quantised after training."""

from collections.abc import Iterator, Sequence
import logging
from pathlib import Path
from typing import Any

from active_recon.datasets.layout import ObjectFolder
from active_recon.errors import ConfigError
from active_recon.geometry.canonical import network_image
from active_recon.models.segmenter_weights import is_segmenter
from active_recon.models.weights_files import read_metadata
from active_recon.runtimes.exported import Arrays, ExportedRuntime
from active_recon.runtimes.graph_files import DECODE_PART, graph_path, INT8_PART, KEY
from active_recon.runtimes.openvino import load_network
from active_recon.volumes.rendering import composite
from active_recon.whole_files import whole_file
import numpy as np

OBJECTS, VIEWS = 60, 5
"""How many objects of a dataset calibrate the ranges of the integers, and views of each."""
_IN_FLOAT = (r'/(?!decoder/)[^/]*$', r'/decoder/[^/]*$', '.*skip_32.*', '.*to_64.*')
"""
What is before the U-Net, whose nodes belong to no layer, and layers of one cell after it: they
take less time in float than to convert what they get.
"""
_BACKGROUNDS = (255, 255, 0, 128)
_QUANTISED = 'lifting'


def require_quantisable(weights: Path) -> None:
    """
    Raise ConfigError where nncf is not installed, or weights are not of the lifting network.

    The loss by integers was measured for that network alone.
    """
    model = 'segmenter' if is_segmenter(weights) else read_metadata(weights).model
    if model != _QUANTISED:
        raise ConfigError(f'{model}: not quantised: expected the network {_QUANTISED}, whose loss '
                          'of IoU is known; take bf16 or f32')
    _nncf()


def quantize(weights: Path, objects: Sequence[ObjectFolder], folder: Path | None = None) -> Path:
    """
    Write the decoder of exported weights with int8 convolutions; return the file.

    Their ranges are those that views of `objects` show, which should be training data. The file
    lies beside the weights, or in another folder. Raises WeightsError where the weights are not
    exported, ConfigError as `require_quantisable` does, and DataError where an object cannot be
    read.
    """
    require_quantisable(weights)
    nncf = _nncf()
    import onnx

    runtime = load_network(weights, 'cpu', None, 'f32', folder)  # refuses what is not exported
    graph = _whole(onnx.load(graph_path(weights, DECODE_PART, folder)))
    names = [each.name for each in graph.graph.input]
    given = [{name: state[name] for name in names} for state in _decoded(runtime, objects)]
    # One range for each channel, the same on both sides of 0: faster, and nearer to float
    found = nncf.quantize(
        graph, nncf.Dataset(given), subset_size=len(given),
        preset=nncf.QuantizationPreset.PERFORMANCE,
        ignored_scope=nncf.IgnoredScope(patterns=list(_IN_FLOAT)),
        advanced_parameters=nncf.AdvancedQuantizationParameters(disable_bias_correction=True))
    for told in found.metadata_props:
        if told.key == KEY:
            told.value = told.value.replace(f'"part": "{DECODE_PART}"', f'"part": "{INT8_PART}"')
    path = graph_path(weights, INT8_PART, folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as unfinished:
        unfinished.write_bytes(found.SerializeToString(deterministic=True))
    return path


def _decoded(runtime: ExportedRuntime, objects: Sequence[ObjectFolder]) -> Iterator[Arrays]:
    """Yield what the decoder gets after some views of some of the objects."""
    rng = np.random.default_rng(0)
    for number in rng.permutation(len(objects))[:OBJECTS]:
        cameras = objects[number].cameras()
        background = int(rng.choice(_BACKGROUNDS))
        state = runtime.initial_state()
        for count, index in enumerate(rng.permutation(len(cameras))[:VIEWS]):
            image = composite(objects[number].image(index), background)
            state = runtime.state_after(
                *network_image(image, cameras[index], runtime.spec), state)
            if count % 2 == 0:
                yield state


def _whole(graph: Any) -> Any:
    """Return a graph whose constants of half precision are stored in whole, as nncf takes them."""
    from onnx import numpy_helper

    stored = {each.name: each for each in graph.graph.initializer}
    nodes = []
    for node in graph.graph.node:
        half = stored.get(node.input[0]) if node.op_type == 'Cast' else None
        if half is None:
            nodes.append(node)
        else:
            values = numpy_helper.to_array(half).astype(np.float32)
            half.CopyFrom(numpy_helper.from_array(values, node.output[0]))
    del graph.graph.node[:]
    graph.graph.node.extend(nodes)
    return graph


def _nncf() -> Any:
    try:
        import nncf
    except ImportError as error:
        raise ConfigError('export: nncf is not installed: expected it, as `pip install '
                          "'active_recon[int8]'` installs it") from error
    logging.getLogger('nncf').setLevel(logging.ERROR)
    return nncf
