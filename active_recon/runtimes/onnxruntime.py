"""Exported graphs in ONNX Runtime, on the CPU or what else an installation of it knows."""

from pathlib import Path
from typing import Any

from active_recon.errors import ConfigError, WeightsError
from active_recon.runtimes.exported import (
    Arrays,
    ExportedDepthRuntime,
    ExportedPolicyRuntime,
    ExportedRuntime,
    ExportedSegmenterRuntime,
    open_depth,
    open_network,
    open_policy,
    open_segmenter,
)
from active_recon.runtimes.graph_files import KEY
from active_recon.runtimes.precision import require_f32
import numpy as np
from numpy.typing import NDArray

_PROVIDERS = {'cpu': ('CPUExecutionProvider',),
              'cuda': ('TensorrtExecutionProvider', 'CUDAExecutionProvider')}
"""What computes on a device; the first that can be used here is taken."""


class OnnxRuntimeGraph:
    """A graph in a session of ONNX Runtime; see Graph."""

    def __init__(self, session: Any) -> None:
        self._session = session
        self.metadata = session.get_modelmeta().custom_metadata_map.get(KEY)
        self.inputs = {each.name: tuple(
            length if isinstance(length, int) else None for length in each.shape)
            for each in session.get_inputs()}
        self.outputs = [each.name for each in session.get_outputs()]

    def run(self, inputs: Arrays) -> dict[str, NDArray[np.float32]]:
        """Return the outputs by name; other inputs are left out."""
        given = {name: np.ascontiguousarray(inputs[name], np.float32) for name in self.inputs}
        return dict(zip(self.outputs, self._session.run(None, given), strict=True))


def load_network(weights: Path | None, device: str, threads: int | None,
                 precision: str) -> ExportedRuntime:
    """Return the network of exported weights; see `load_runtime`."""
    opener = _Opener(device, threads, precision)
    loaded = open_network(weights, opener)
    loaded.provenance = {**loaded.provenance, 'computed_by': opener.told()}
    return loaded


def load_policy(weights: Path | None, device: str, threads: int | None,
                precision: str) -> ExportedPolicyRuntime:
    """Return the policy that was exported beside weights; see `load_policy_runtime`."""
    opener = _Opener(device, threads, 'f32')  # it takes no time in f32
    loaded = open_policy(weights, opener)
    loaded.provenance = {'computed_by': opener.told()}
    return loaded


def load_depth(weights: Path | None, device: str, threads: int | None,
               precision: str) -> ExportedDepthRuntime:
    """Return the depth refiner that was exported beside weights; see `load_depth_runtime`."""
    opener = _Opener(device, threads, 'f32')
    loaded = open_depth(weights, opener)
    loaded.provenance = {'computed_by': opener.told()}
    return loaded


def load_segmenter(weights: Path, device: str, threads: int | None,
                   precision: str) -> ExportedSegmenterRuntime:
    """Return the exported segmenter; see `load_segmenter_runtime`."""
    opener = _Opener(device, threads, precision)
    loaded = open_segmenter(weights, opener)
    loaded.provenance = {'computed_by': opener.told()}
    return loaded


class _Opener:
    """Opens graphs on a device, with a number of threads, None for all cores."""

    def __init__(self, device: str, threads: int | None, precision: str) -> None:
        require_f32(precision, 'onnxruntime')
        try:
            import onnxruntime
        except ImportError as error:
            raise ConfigError('runtime: onnxruntime is not installed: expected it, as `pip '
                              "install 'active_recon[onnxruntime]'` installs it, or the runtime "
                              'torch') from error
        self._library, self._threads, self._device = onnxruntime, threads or 0, device
        known = onnxruntime.get_available_providers()
        self._providers = [name for name in _PROVIDERS.get(device, ()) if name in known]
        if not self._providers:
            raise ConfigError(f'parameter device: {device} not available: expected one that this '
                              f'onnxruntime knows, which has {", ".join(known)}; use cpu')
        self._taken: set[str] = set()

    def told(self) -> str:
        """Return what computes the graphs that were opened, in words."""
        threads = f'{self._threads} threads' if self._threads else 'all threads'
        taken = ' and '.join(name.removesuffix('ExecutionProvider')
                             for name in sorted(self._taken))
        return f'onnxruntime {self._library.__version__}, f32, {taken}, {threads}'

    def __call__(self, path: Path, half: bool) -> OnnxRuntimeGraph:
        """Return the graph in a file; see OpenGraph."""
        options = self._library.SessionOptions()
        options.intra_op_num_threads = self._threads
        options.log_severity_level = 3  # errors
        options.add_session_config_entry('session.intra_op.allow_spinning', '0')
        try:
            session = self._library.InferenceSession(path, options, providers=self._providers)
        except Exception as error:  # the library has no error of its own above all others
            raise WeightsError(f'{path}: no whole ONNX file: '
                               f'{str(error).strip().splitlines()[0]}') from error
        # A provider that is built in and whose libraries are missing is left out in silence
        taken = session.get_providers()[0]
        if taken not in self._providers:
            raise ConfigError(f'parameter device: {self._device} cannot be used: expected '
                              f'{" or ".join(self._providers)} to start, but this onnxruntime '
                              f'took {taken}: install the libraries that it needs, or use cpu')
        self._taken.add(taken)
        return OnnxRuntimeGraph(session)
