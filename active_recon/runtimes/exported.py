"""Exported networks and policies, whatever library runs their graphs."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Protocol

from active_recon.errors import WeightsError
from active_recon.geometry.cameras import Camera, orbit_camera
from active_recon.geometry.canonical import network_image, NetworkSpec
from active_recon.models.weights_files import depth_path, scorer_path, SHIPPED, weights_hash
from active_recon.runtimes.base import State
from active_recon.runtimes.graph_files import (
    DECODE_PART,
    DEPTH_PART,
    graph_path,
    GraphMetadata,
    INT8_PART,
    NETWORK_PARTS,
    NEXT,
    POLICY_PART,
    read_graph_metadata,
    require_shapes,
    SEGMENT_PART,
)
import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[np.float32]]
_FACTS = {'threshold': float, 'image_size': int, 'resolution': int, 'needs_front': bool,
          'config_sha256': str}
"""What the metadata of a network tell, and as what."""


class Graph(Protocol):
    """
    A graph that a library has read and can run.

    - inputs: their shapes by name, None for an axis of any length; outputs: their names
    - metadata: the text under `graph_files.KEY`, None where there is none
    """

    @property
    def inputs(self) -> Mapping[str, Sequence[int | None]]: ...

    @property
    def outputs(self) -> Sequence[str]: ...

    @property
    def metadata(self) -> str | None: ...

    def run(self, inputs: Arrays) -> dict[str, NDArray[np.float32]]:
        """Return the outputs by name, in arrays of their own; other inputs are left out."""
        ...


OpenGraph = Callable[[Path, bool], Graph]
"""Opens a file; whether half precision may be used in it. Raises WeightsError."""


class ExportedRuntime:
    """A reconstruction network in graphs; see Runtime."""

    def __init__(self, graphs: Mapping[str, Graph], told: GraphMetadata) -> None:
        self._encode, self._update, self._decode = (graphs[part] for part in NETWORK_PARTS)
        facts = told.facts
        self.spec = NetworkSpec(facts['image_size'], facts['resolution'], facts['needs_front'])
        self.threshold = float(facts['threshold'])
        self.provenance: Mapping[str, str] = {
            'weights_sha256': told.weights_sha256, 'config_sha256': facts['config_sha256']}
        self._state = told.state

    def initial_state(self) -> State:
        """Return the state before any view."""
        return first_state(self._state, 1)

    def step(self, image: NDArray[np.uint8], camera: Camera,
             state: State) -> tuple[NDArray[np.float32], NDArray[np.float32], State]:
        """Take in an image; see Runtime."""
        after = self.state_after(image, camera, state)
        return self.decode(after)[0], after['latent'][0], after

    def state_after(self, image: NDArray[np.uint8], camera: Camera, state: State) -> State:
        """Return the next state after an image."""
        seen_from = {'pose': camera.pose[None].astype(np.float32),
                     'intrinsics': camera.intrinsics.matrix[None].astype(np.float32)}
        return self.update(self.encode(planes_of(image), seen_from), seen_from, state)

    def encode(self, planes: NDArray[np.float32], seen_from: Arrays) -> NDArray[np.float32]:
        """
        Return the encoding of one image (1, 3 or 4, S, S) in [0, 1].

        `seen_from` is its camera: `pose` (1, 4, 4) and `intrinsics` (1, 3, 3).
        """
        return self._encode.run({'image': _as_wanted(self._encode, planes),
                                 **seen_from})['encoded']

    def update(self, encoded: NDArray[np.float32], seen_from: Arrays, state: State) -> State:
        """Return the next state after an encoded image."""
        found = self._update.run({'encoded': encoded, **seen_from, **state})
        return {name.removeprefix(NEXT): array for name, array in found.items()}

    def decode(self, state: State) -> NDArray[np.float32]:
        """Return the occupancy (1, R, R, R) of a state after a view."""
        return self._decode.run(state)['occupancy']

    def warm_up(self) -> None:
        """Run once, so that the first view is as fast as the others."""
        camera = orbit_camera(0.0)
        blank = np.zeros((camera.intrinsics.height, camera.intrinsics.width, 3), np.uint8)
        self.step(*network_image(blank, camera, self.spec), self.initial_state())


class ExportedPolicyRuntime:
    """The model of a learned view policy in a graph; see PolicyRuntime."""

    def __init__(self, graph: Graph, told: GraphMetadata) -> None:
        self._graph, self._state = graph, told.state
        self.facts = told.facts
        self.provenance: Mapping[str, str] = {}

    def initial_state(self, batch: int) -> State:
        """Return the state before any view."""
        return first_state(self._state, batch)

    def step(self, inputs: Arrays, state: State) -> tuple[Arrays, State]:
        """Return the model's outputs after a view, and the next state."""
        found = self._graph.run({**inputs, **state})
        after = {name: found.pop(NEXT + name) for name in self._state}
        return found, after


class ExportedDepthRuntime:
    """A depth refiner in a graph; see DepthRuntime."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self.provenance: Mapping[str, str] = {}

    def refine(self, occupancy: NDArray[np.float32], evidence: NDArray[np.float32],
               state: State) -> NDArray[np.float32]:
        """Return the corrected occupancy; see DepthRuntime."""
        refined: NDArray[np.float32] = self._graph.run(
            {'occupancy': occupancy[None], 'evidence': evidence[None],
             'count': state['coarse_count'], 'total': state['coarse_sum']})['refined'][0]
        return refined


class ExportedSegmenterRuntime:
    """A segmenter in a graph; see SegmenterRuntime."""

    def __init__(self, graph: Graph, image_size: int) -> None:
        self._graph, self.image_size = graph, image_size
        self.provenance: Mapping[str, str] = {}

    def segment(self, image: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return how likely each pixel is the object's; see SegmenterRuntime."""
        found = self._graph.run({'image': _as_wanted(self._graph, planes_of(image))})['object']
        return np.asarray(found[0, 0])


def planes_of(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return an image, (S, S, C) uint8, as (1, C, S, S) in [0, 1]."""
    return np.asarray(image.transpose(2, 0, 1)[None] * np.float32(1 / 255))


def _as_wanted(graph: Graph, planes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return planes (1, C, S, S) as a graph takes them; a missing mask of pixels seen is 1."""
    wanted = graph.inputs['image'][1]
    if wanted is not None and planes.shape[1] < wanted:
        planes = np.pad(planes, ((0, 0), (0, 1), (0, 0), (0, 0)), constant_values=1)
    return planes


def first_state(described: Mapping[str, tuple[Sequence[int], float]], batch: int) -> State:
    """Return the state before any view of so many objects."""
    return {name: np.full((batch, *shape), value, np.float32)
            for name, (shape, value) in described.items()}


def open_network(weights: Path | None, open_graph: OpenGraph,
                 int8: bool = False, folder: Path | None = None) -> ExportedRuntime:
    """
    Return the exported network beside weights; None: of those that ship.

    `int8`: with the decoder of that precision. Raises WeightsError.
    """
    weights = weights or SHIPPED
    digest = weights_hash(weights)

    def opened(part: str) -> tuple[Graph, GraphMetadata]:
        file = INT8_PART if int8 and part == DECODE_PART else part
        # The update adds up over views, which half precision is too coarse for
        return _opened(weights, file, digest, open_graph, part != 'update', folder)

    with ThreadPoolExecutor(len(NETWORK_PARTS)) as pool:  # a node's start waits for little else
        parts = dict(zip(NETWORK_PARTS, pool.map(opened, NETWORK_PARTS), strict=True))
    graphs = {part: graph for part, (graph, _) in parts.items()}
    told = {part: metadata for part, (_, metadata) in parts.items()}
    if any(each.facts != told['update'].facts for each in told.values()):
        raise WeightsError(f'{graph_path(weights, "update")}: exported at another time than the '
                           'parts beside it; export the weights anew')
    _require_parts(weights, graphs, told['update'])
    return ExportedRuntime(graphs, told['update'])


def open_policy(weights: Path | None, open_graph: OpenGraph) -> ExportedPolicyRuntime:
    """Return the exported policy beside weights; None: beside those that ship. WeightsError."""
    weights = weights or SHIPPED
    digest = weights_hash(weights)
    graph, told = _opened(weights, POLICY_PART, digest, open_graph, False)
    beside = scorer_path(weights)
    own = weights_hash(beside) if beside.is_file() else digest
    if told.facts.get('policy_sha256') != own:
        raise WeightsError(f'{graph_path(weights, POLICY_PART)}: exported from another view '
                           f'policy: expected that of {beside.name}, trained since; export the '
                           'weights anew')
    return ExportedPolicyRuntime(graph, told)


def open_depth(weights: Path | None, open_graph: OpenGraph) -> ExportedDepthRuntime:
    """Return the exported depth refiner beside weights; None: of those that ship. WeightsError."""
    weights = weights or SHIPPED
    # Half precision changes the IoU of 60 models by less than 0.0001, and takes half the time
    graph, told = _opened(weights, DEPTH_PART, weights_hash(weights), open_graph, True)
    beside = depth_path(weights)
    if beside.is_file() and told.facts.get('depth_sha256') != weights_hash(beside):
        raise WeightsError(f'{graph_path(weights, DEPTH_PART)}: exported from another depth '
                           f'refiner: expected that of {beside.name}, trained since; export the '
                           'weights anew')
    return ExportedDepthRuntime(graph)


def open_segmenter(weights: Path, open_graph: OpenGraph) -> ExportedSegmenterRuntime:
    """Return the segmenter that was exported beside its weights. Raises WeightsError."""
    graph, told = _opened(weights, SEGMENT_PART, weights_hash(weights), open_graph, True)
    path = graph_path(weights, SEGMENT_PART)
    _require_facts(path, told, {'image_size': int})
    _require_image(path, graph, told.facts['image_size'])
    if 'object' not in graph.outputs:
        raise WeightsError(f'{path}: contradicts its metadata: expected the output object, got '
                           f'{", ".join(graph.outputs)}')
    return ExportedSegmenterRuntime(graph, told.facts['image_size'])


def _opened(weights: Path, part: str, digest: str, open_graph: OpenGraph,
            half: bool, folder: Path | None = None) -> tuple[Graph, GraphMetadata]:
    path = graph_path(weights, part, folder)
    if not path.is_file():
        if part == INT8_PART:
            raise WeightsError(f'{weights.name}: not quantised: expected {path.name} beside it, '
                               'which `active-recon export --int8` makes; take bf16 or f32')
        raise WeightsError(f'{weights.name}: not exported: expected {path.name} beside it, which '
                           '`active-recon export` makes; the runtime torch needs none')
    graph = open_graph(path, half)
    told = read_graph_metadata(path, graph.metadata, part, digest)
    require_shapes(path, told, graph.inputs, graph.outputs, 1)
    return graph, told


def _require_parts(weights: Path, graphs: Mapping[str, Graph], told: GraphMetadata) -> None:
    """Raise WeightsError where the parts of a network do not give what the next of them takes."""
    _require_facts(graph_path(weights, 'update'), told)
    camera = {'pose', 'intrinsics'}
    size = told.facts['image_size']
    given = {'encode': {'image', *camera}, 'update': {'encoded', *camera, *told.state},
             'decode': set(told.state)}
    gives = {'encode': ['encoded'], 'update': [], 'decode': ['occupancy']}
    for part, graph in graphs.items():
        path = graph_path(weights, part)
        if wrong := set(graph.inputs) - given[part]:
            raise WeightsError(f'{path}: contradicts its metadata: expected inputs among '
                               f'{", ".join(sorted(given[part]))}, got {", ".join(sorted(wrong))}')
        if not set(gives[part]) <= set(graph.outputs):
            raise WeightsError(f'{path}: contradicts its metadata: expected the output '
                               f'{gives[part][0]}, got {", ".join(graph.outputs)}')
    _require_image(graph_path(weights, 'encode'), graphs['encode'], size)


def _require_image(path: Path, graph: Graph, size: int) -> None:
    """Raise WeightsError where a graph takes images of another size than its metadata tell."""
    image = tuple(graph.inputs.get('image', ()))
    if image[2:] != (size, size):
        raise WeightsError(f'{path}: contradicts its metadata: expected images of {size} pixels, '
                           f'got {image}')


def _require_facts(path: Path, told: GraphMetadata, facts: Mapping[str, type] = _FACTS) -> None:
    """Raise WeightsError where the metadata lack what a network says of itself."""
    for name, kind in facts.items():
        found = told.facts.get(name)
        if not isinstance(found, kind):
            raise WeightsError(f'{path}: its metadata cannot be used: expected {name} as '
                               f'{kind.__name__}, got {found!r}; export the weights anew')
