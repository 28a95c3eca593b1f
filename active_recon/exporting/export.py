"""Weights to ONNX files with their metadata inside."""

from collections.abc import Mapping
import io
from pathlib import Path
from typing import Any
import warnings

from active_recon.errors import ConfigError
from active_recon.exporting.parts import (
    depth_part,
    network_parts,
    Part,
    policy_part,
    segment_part,
)
from active_recon.models.candidate_looks import CHANNELS, FACTS, GRID
from active_recon.models.depth_weights import load_refiner
from active_recon.models.lifting_encoder import IMAGE_SIZE
from active_recon.models.network import ReconstructionNetwork, State
from active_recon.models.scorer_weights import load_scorer
from active_recon.models.segmenter_weights import is_segmenter, read_segmenter
from active_recon.models.weights import Bundle, load_weights
from active_recon.models.weights_files import (
    config_hash,
    depth_path,
    scorer_path,
    weights_hash,
)
from active_recon.runtimes.graph_files import (
    DEPTH_PART,
    graph_path,
    GraphMetadata,
    KEY,
    POLICY_PART,
    SEGMENT_PART,
)
from active_recon.whole_files import whole_file, writable_folder
import numpy as np
import torch

_OPSET = 17
_LARGE = 64  # numbers; fewer are not worth another node
_MODEL_VERSION = 8  # of ONNX files, the one that goes with the opset


def export(weights: Path, folder: Path | None = None) -> list[Path]:
    """
    Write the graphs of weights, and of what goes with them; return the files.

    That is the view policy in them or beside them, and the depth refiner beside them. Weights of
    a segmenter are a graph of their own.

    They lie beside the weights, or in another folder, and appear whole. Raises WeightsError as
    `load_weights` does, and ConfigError where the network runs in torch alone, where it has
    something that no graph can have, where onnx is not installed, or where no file can be written.
    """
    _require_onnx()
    place = folder or weights.parent
    if is_segmenter(weights):
        writable_folder(place)
        told = GraphMetadata(SEGMENT_PART, weights_hash(weights), {}, {'image_size': IMAGE_SIZE})
        part = segment_part(read_segmenter(weights))
        return _saved({SEGMENT_PART: _written('segmenter', part, told)}, weights, folder)
    bundle = load_weights(weights)
    network, digest = bundle.reconstruction, weights_hash(weights)
    if network.runs_in_torch_alone:
        raise ConfigError(f'{bundle.model}: not exported: {network.runs_in_torch_alone}; it runs '
                          'with the runtime torch')
    spec = network.spec
    facts = {'model': bundle.model, 'threshold': bundle.threshold, 'image_size': spec.image_size,
             'resolution': spec.resolution, 'needs_front': spec.needs_front,
             'config_sha256': config_hash(bundle.config)}
    first = network.initial_state(1)
    parts = _parts(bundle.model, network)
    _require_steady(bundle.model, first, dict(parts['decode'].inputs))
    state = _described(bundle.model, first)
    writable_folder(place)  # tells before the networks are traced
    graphs = {name: _written(bundle.model, part, GraphMetadata(name, digest, state, facts))
              for name, part in parts.items()}
    graphs |= _policy_graph(weights, bundle, digest)
    if depth_path(weights).is_file():
        told = GraphMetadata(DEPTH_PART, digest, {},
                             {'depth_sha256': weights_hash(depth_path(weights))})
        graphs[DEPTH_PART] = _written(bundle.model, depth_part(load_refiner(weights)), told)
    return _saved(graphs, weights, folder)


def _saved(graphs: Mapping[str, bytes], weights: Path, folder: Path | None) -> list[Path]:
    """Write graphs beside weights, or in another folder; return the files."""
    written = []
    for name, data in graphs.items():
        written.append(graph_path(weights, name, folder))
        with whole_file(written[-1]) as unfinished:
            unfinished.write_bytes(data)
    return written


def _policy_graph(weights: Path, bundle: Bundle, digest: str) -> dict[str, bytes]:
    """Return the graph of the view policy that goes with weights; {} where none does."""
    model: Any
    if bundle.attention is not None:
        model = bundle.attention
        latent = torch.zeros(2, *model.facts['latent_shape'])
        inputs, axes = {'latent': latent, 'azimuth': torch.zeros(2)}, {}
        own = digest
    elif scorer_path(weights).is_file():
        model, own = load_scorer(weights), weights_hash(scorer_path(weights))
        count = 3
        inputs = {'grids': torch.zeros(2, count, CHANNELS, GRID, GRID, GRID),
                  'facts': torch.zeros(2, count, FACTS), 'views': torch.ones(2)}
        axes = {name: {1: 'candidates'} for name in ('grids', 'facts', 'gain')}
    else:
        return {}
    facts = {**model.facts, 'policy_sha256': own}
    told = GraphMetadata(POLICY_PART, digest, _described(bundle.model, model.initial_state(1)),
                         facts)
    return {POLICY_PART: _written(bundle.model, policy_part(model, inputs, axes), told)}


def _parts(model: str, network: ReconstructionNetwork) -> dict[str, Part]:
    try:
        return network_parts(network)
    except RuntimeError as error:
        raise ConfigError(f'{model}: not exported: expected a network that takes cameras in '
                          f'float32, got: {str(error).strip().splitlines()[0]}') from error


def _require_steady(model: str, first: State, after: State) -> None:
    """Raise ConfigError where a view changes more of a state than its float32 numbers."""
    kinds = [{name: f'{str(part.dtype).removeprefix("torch.")} {tuple(part.shape)}'
              for name, part in state.items()} for state in (first, after)]
    if kinds[0] != kinds[1] or any(part.dtype != torch.float32 or not part.numel()
                                   for part in first.values()):
        raise ConfigError(f'{model}: not exported: expected a state of float32 numbers whose '
                          f'shapes no view changes, got {kinds[0]} before a view and {kinds[1]} '
                          'after it; it runs with the runtime torch')


def _described(model: str, state: State) -> dict[str, tuple[tuple[int, ...], float]]:
    """Return the shapes of a first state, without the axis of objects, and its values."""
    described = {}
    for name, part in state.items():
        value = float(part.flatten()[0])
        if not bool((part == value).all()):
            raise ConfigError(f'{model}: not exported: expected a first state of one value in '
                              f'each array, got several in {name}')
        described[name] = (tuple(part.shape[1:]), value)
    return described


def _written(model: str, part: Part, told: GraphMetadata) -> bytes:
    """Return the ONNX file of a part."""
    import onnx

    found = io.BytesIO()
    with warnings.catch_warnings(), torch.no_grad():
        # The exporter that needs no other package is called old; shapes are constant here
        warnings.simplefilter('ignore')
        try:
            torch.onnx.export(
                part.module, tuple(part.inputs.values()), found,  # type: ignore[arg-type]
                input_names=list(part.inputs), output_names=list(part.outputs),
                dynamic_axes=part.dynamic, opset_version=_OPSET, dynamo=False)
        except (RuntimeError, torch.onnx.errors.OnnxExporterError) as error:
            first = str(error).strip().splitlines()[0]
            raise ConfigError(f'{model}: not exported: expected operations that ONNX has, got '
                              f'{first}') from error
    graph = onnx.load_from_string(found.getvalue())
    _join(graph)
    _halve(graph)
    graph.metadata_props.add(key=KEY, value=told.to_json())
    return bytes(graph.SerializeToString(deterministic=True))


def _join(graph: Any) -> None:
    """Leave out the second names of equal weights, which ONNX Runtime stumbles over."""
    stored = {each.name for each in graph.graph.initializer}
    given = {each.name for each in graph.graph.output}  # a state may be a weight
    second = {node.output[0]: node.input[0] for node in graph.graph.node
              if node.op_type == 'Identity' and node.input[0] in stored
              and node.output[0] not in given}
    nodes = [node for node in graph.graph.node if node.output[0] not in second]
    for node in nodes:
        for place, name in enumerate(node.input):
            node.input[place] = second.get(name, name)
    del graph.graph.node[:]
    graph.graph.node.extend(nodes)


def _halve(graph: Any) -> None:
    """Store what half precision holds exactly in half precision, as weights files do."""
    from onnx import helper, numpy_helper, TensorProto

    for stored in graph.graph.initializer:
        values = numpy_helper.to_array(stored)
        half = values.astype(np.float16) if values.dtype == np.float32 else None
        if half is None or values.size < _LARGE or not np.array_equal(
                half.astype(np.float32), values):
            continue
        name = stored.name
        stored.CopyFrom(numpy_helper.from_array(half, f'{name}.half'))
        graph.graph.node.insert(0, helper.make_node(
            'Cast', [f'{name}.half'], [name], to=TensorProto.FLOAT))


def _require_onnx() -> None:
    try:
        import onnx  # noqa: F401
    except ImportError as error:
        raise ConfigError('export: onnx is not installed: expected it, as `pip install '
                          "'active_recon[export]'` installs it") from error
