"""Exported graphs in OpenVINO, on the CPU; what was compiled is kept for the next start."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
import sys
from threading import Lock
from typing import Any

from active_recon.errors import ConfigError, WeightsError
from active_recon.runtimes.base import REMARK
from active_recon.runtimes.compiled_cache import compiled_path, read_compiled, write_compiled
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
from active_recon.runtimes.precision import chosen_precision, has_bf16, INT8
import numpy as np
from numpy.typing import NDArray

_CONVERTER = 'openvino.tools.ovc'
"""OpenVINO's converter of other formats, which reports home too: two thirds of its import."""
_LENGTH = 8  # bytes of the length of the metadata in what is kept


class OpenVinoGraph:
    """A graph compiled by OpenVINO; see Graph."""

    def __init__(self, compiled: Any, metadata: str | None) -> None:
        self.metadata = metadata
        # A tensor may have several names: those of inputs and outputs, and such as /Cast_output_0
        self.inputs = {name: tuple(length.get_length() if length.is_static else None
                                   for length in port.get_partial_shape())
                       for port in compiled.inputs for name in port.get_names()
                       if name.isidentifier()}
        self._names = [tuple(filter(str.isidentifier, port.get_names()))
                       for port in compiled.outputs]
        self.outputs = [name for names in self._names for name in names]
        self._lock = Lock()
        self._request = compiled.create_infer_request()
        shapes = [port.get_partial_shape() for port in compiled.outputs]
        self._shapes = ([tuple(shape.to_shape()) for shape in shapes]
                        if all(shape.is_static for shape in shapes) else None)

    def run(self, inputs: Arrays) -> dict[str, NDArray[np.float32]]:
        """Return the outputs by name; other inputs are left out."""
        with self._lock:  # a request computes one thing at a time, and a segmenter is shared
            return self._run(inputs)

    def _run(self, inputs: Arrays) -> dict[str, NDArray[np.float32]]:
        from openvino import Tensor

        # What was read from a message cannot be written to, which OpenVINO does not share
        given = {name: np.require(inputs[name], np.float32, ('C', 'W')) for name in self.inputs}
        if self._shapes is None:
            self._request.infer(given, share_inputs=True, share_outputs=True)
            found = [np.array(self._request.get_output_tensor(place).data)
                     for place in range(len(self._names))]
        else:
            found = [np.empty(shape, np.float32) for shape in self._shapes]
            for place, array in enumerate(found):  # computed where they are to be: no copy
                self._request.set_output_tensor(place, Tensor(array, shared_memory=True))
            self._request.infer(given, share_inputs=True, share_outputs=True)
        return {name: array for names, array in zip(self._names, found, strict=True)
                for name in names}


def load_network(weights: Path | None, device: str, threads: int | None,
                 precision: str, folder: Path | None = None) -> ExportedRuntime:
    """Return the network of exported weights; see `load_runtime`."""
    opener = _Opener(threads, chosen_precision(precision, device))
    loaded = open_network(weights, opener, opener.is_int8, folder)
    loaded.provenance = {**loaded.provenance, **opener.provenance}
    return loaded


def load_policy(weights: Path | None, device: str, threads: int | None,
                precision: str) -> ExportedPolicyRuntime:
    """Return the policy that was exported beside weights; see `load_policy_runtime`."""
    chosen_precision(precision, device)
    opener = _Opener(threads, 'f32')  # it takes no time in f32
    loaded = open_policy(weights, opener)
    loaded.provenance = opener.provenance
    return loaded


def load_depth(weights: Path | None, device: str, threads: int | None,
               precision: str) -> ExportedDepthRuntime:
    """Return the depth refiner that was exported beside weights; see `load_depth_runtime`."""
    opener = _float_opener(threads, precision, device)
    loaded = open_depth(weights, opener)
    loaded.provenance = opener.provenance
    return loaded


def load_segmenter(weights: Path, device: str, threads: int | None,
                   precision: str) -> ExportedSegmenterRuntime:
    """Return the exported segmenter; see `load_segmenter_runtime`."""
    opener = _float_opener(threads, precision, device)
    loaded = open_segmenter(weights, opener)
    loaded.provenance = opener.provenance
    return loaded


def _float_opener(threads: int | None, precision: str, device: str) -> '_Opener':
    """Return what opens graphs that have no form in integers."""
    chosen = chosen_precision(precision, device)
    return _Opener(threads, 'bf16' if chosen == INT8 and has_bf16() else chosen)


class _Opener:
    """Opens graphs for a number of threads, None for all cores, and a precision."""

    def __init__(self, threads: int | None, precision: str) -> None:
        self.is_int8 = precision == INT8
        # What is no integer in a graph of int8 is as small as the processor has it
        self._float = ('bf16' if has_bf16() else 'f32') if self.is_int8 else precision
        self._precision = f'int8 with {self._float}' if self.is_int8 else precision
        self._asked, self._threads, self._remark = threads, threads or 0, ''
        _core()  # imported before the threads that open graphs

    @property
    def provenance(self) -> dict[str, str]:
        """What computes, in words, once a graph was opened, and what to say of it."""
        told = f'openvino {_version()}, {self._precision}, {_processor()}, {self._threads} threads'
        return {'computed_by': told, **({REMARK: self._remark} if self._remark else {})}

    def __call__(self, path: Path, half: bool) -> OpenVinoGraph:
        """Return the graph in a file; see OpenGraph."""
        # Several processes share a robot's cores: none may be bound to one of them
        settings: dict[str, Any] = {
            'INFERENCE_PRECISION_HINT': self._float if half else 'f32', 'NUM_STREAMS': 1,
            'PERFORMANCE_HINT': 'LATENCY', 'ENABLE_CPU_PINNING': False,
            **({'INFERENCE_NUM_THREADS': self._asked} if self._asked else {})}
        try:
            exported = path.read_bytes()
        except OSError as error:
            raise WeightsError(f'{path}: cannot be read: {error.strerror}') from error
        kept = compiled_path(exported, path.stem, _version(), _processor(), repr(settings))
        taken = _taken(read_compiled(kept), settings)
        if taken is None:
            taken = compiled, metadata = _compiled(path, exported, settings)
            self._remark = write_compiled(kept, _packed(compiled, metadata)) or self._remark
        compiled, metadata = taken
        self._threads = int(compiled.get_property('INFERENCE_NUM_THREADS'))
        return OpenVinoGraph(compiled, metadata)


def _taken(kept: memoryview | None, settings: Mapping[str, Any]) -> tuple[Any, str | None] | None:
    """Return a graph that was compiled before and its metadata, None where that fails."""
    if kept is None:
        return None
    length = int.from_bytes(kept[:_LENGTH], 'little')
    metadata = bytes(kept[_LENGTH:_LENGTH + length]).decode()
    try:
        return _core().import_model(bytes(kept[_LENGTH + length:]), 'CPU', settings), (
            metadata or None)
    except RuntimeError:
        return None


def _packed(compiled: Any, metadata: str | None) -> bytes:
    """Return what `_taken` takes."""
    told = (metadata or '').encode()
    blob: bytes = compiled.export_model().getvalue()
    return len(told).to_bytes(_LENGTH, 'little') + told + blob


def _compiled(path: Path, exported: bytes,
              settings: Mapping[str, Any]) -> tuple[Any, str | None]:
    """Compile an exported file; return it and its metadata. Raises WeightsError."""
    try:
        model = _core().read_model(exported)
        compiled = _core().compile_model(model, 'CPU', settings)
    except RuntimeError as error:
        raise WeightsError(f'{path}: no whole ONNX file: {_last_line(error)}') from error
    return compiled, _metadata(model)


def _metadata(model: Any) -> str | None:
    try:
        return str(model.get_rt_info(['framework', KEY]).value)
    except RuntimeError:
        return None


@cache
def _core() -> Any:
    try:
        with _without(_CONVERTER):
            import openvino
    except ImportError as error:
        raise ConfigError('runtime: openvino is not installed: expected it, as `pip install '
                          'openvino` installs it, or the runtime torch') from error
    return openvino.Core()


@contextmanager
def _without(module: str) -> Iterator[None]:
    """Let an import of a module that was not imported before fail, as if it were not installed."""
    if module in sys.modules:
        yield
        return
    sys.modules[module] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        del sys.modules[module]


def _version() -> str:
    _core()
    import openvino

    return str(openvino.__version__).partition('-')[0]


def _processor() -> str:
    return str(_core().get_property('CPU', 'FULL_DEVICE_NAME'))


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
