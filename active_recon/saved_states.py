"""An episode in a file, to go on with later or on another machine: safetensors, no code."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
import json
from pathlib import Path
from typing import Any

from active_recon.errors import DataError, ViewError
from active_recon.geometry.cameras import Camera, Intrinsics
from active_recon.json_text import json_value
from active_recon.meshes.photos import Photo
from active_recon.quality.quality import Quality
from active_recon.quality.silhouettes import SeenView
from active_recon.reconstructor import Progress, Reconstruction, Reconstructor
from active_recon.volumes.depth_evidence import no_evidence
from active_recon.volumes.voxels import VoxelGrid
from active_recon.whole_files import whole_file
import numpy as np
from numpy.typing import NDArray
from safetensors import safe_open, SafetensorError
from safetensors.numpy import save

SUFFIX = '.state.safetensors'
_FORMAT = '1'
_EVIDENCE = 'depth_evidence'
_LENS = ('fx', 'fy', 'cx', 'cy', 'width', 'height')
_SAME = {'weights_sha256': 'weights', 'resolution': 'cells a side', 'object_size':
         'object_size, metres', 'object_yaw': 'object_yaw, radians'}
"""What a file and the reconstructor have to agree on, in words."""


@dataclass(frozen=True, eq=False)
class SavedState:
    """
    An episode after some views: what the reconstructor knows, and what the node keeps of them.

    - reconstruction: after the last view, without the network's image
    - photos: for colours; last_camera: of the last view, without its lens
    """

    progress: Progress
    reconstruction: Reconstruction
    photos: Sequence[Photo]
    last_camera: Camera


def write_state(saved: SavedState, reconstructor: Reconstructor, path: Path) -> None:
    """
    Write an episode of a reconstructor to a file, which appears at once and whole.

    Raises DataError or OSError where it cannot be written.
    """
    progress, known = saved.progress, saved.reconstruction
    arrays: dict[str, NDArray[Any]] = {
        **{f'state/{name}': array for name, array in progress.state.items()},
        'occupancy': known.grid.occupancy, 'latent': known.latent,
        'last_pose': saved.last_camera.pose,
        **({} if progress.evidence is None else {_EVIDENCE: progress.evidence}),
        **_written_cameras('seen', [view.camera for view in progress.seen]),
        **_written_cameras('photo', [photo.camera for photo in saved.photos])}
    for number, view in enumerate(progress.seen):
        arrays[f'foreground/{number}'] = view.foreground
        arrays[f'known/{number}'] = view.seen
    for number, photo in enumerate(saved.photos):
        arrays[f'image/{number}'] = photo.image
    facts = {**_facts(reconstructor), 'format': _FORMAT, 'views': str(progress.view_count),
             'quality': json.dumps(known.quality and asdict(known.quality))}
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as unfinished:
        try:
            # Not by `save_file`: what it writes only its owner can read
            unfinished.write_bytes(save(
                {name: np.ascontiguousarray(array) for name, array in arrays.items()}, facts))
        except (OSError, SafetensorError) as error:
            raise DataError(str(error)) from error


def read_state(path: Path, reconstructor: Reconstructor) -> SavedState:
    """
    Read an episode that this reconstructor can go on with.

    Raises DataError where the file is missing, truncated or no such file, or of other weights,
    another resolution, size or yaw.
    """
    try:
        with safe_open(path, 'np') as file:
            facts = file.metadata() or {}
            # Those of another file may have numbers that numpy has not, as bfloat16
            arrays = {name: file.get_tensor(name) for name in file.keys()  # noqa: SIM118
                      if facts.get('format') == _FORMAT}
    except (OSError, SafetensorError) as error:
        raise DataError(f'{path}: no readable state: expected a whole file of save_state, got: '
                        f'{error}') from error
    if facts.get('format') != _FORMAT:
        raise DataError(f'{path}: no state: expected a file of save_state in format {_FORMAT}, '
                        f'got {facts.get("format", "another file")}')
    for name, own in _facts(reconstructor).items():
        if facts.get(name) != own:
            raise DataError(f'{path}: a state of other {_SAME[name]}: expected {own[:12]}, got '
                            f'{facts.get(name, "none")[:12]}')
    try:
        return _read(facts, arrays, reconstructor)
    except (KeyError, ValueError, TypeError, IndexError, OverflowError, ViewError,
            DataError) as error:
        raise DataError(f'{path}: a spoilt state: expected what save_state wrote, got '
                        f'{type(error).__name__}: {error}') from error


def _facts(reconstructor: Reconstructor) -> dict[str, str]:
    return {'weights_sha256': reconstructor.provenance.get('weights_sha256', ''),
            'resolution': str(reconstructor.spec.resolution),
            'object_size': repr(float(reconstructor.object_size)),
            'object_yaw': repr(float(reconstructor.object_yaw))}


def _read(facts: Mapping[str, str], arrays: Mapping[str, NDArray[Any]],
          reconstructor: Reconstructor) -> SavedState:
    state = {name.removeprefix('state/'): array for name, array in arrays.items()
             if name.startswith('state/')}
    shapes, expected = ({name: array.shape for name, array in each.items()}
                        for each in (state, reconstructor.initial_state()))
    if shapes.keys() != expected.keys() or not all(
            _is_as(shapes[name], first) for name, first in expected.items()):
        raise ValueError(f'expected arrays {expected}, got {shapes}')
    seen = [SeenView(camera, arrays[f'foreground/{number}'], arrays[f'known/{number}'])
            for number, camera in enumerate(_read_cameras('seen', arrays))]
    photos = [Photo(arrays[f'image/{number}'], camera)
              for number, camera in enumerate(_read_cameras('photo', arrays))]
    evidence, side = arrays.get(_EVIDENCE), reconstructor.spec.resolution
    if evidence is not None and evidence.shape != no_evidence(side).shape:
        raise ValueError(f'depth evidence of {evidence.shape}')
    told = json_value(facts['quality'])
    quality = Quality(**told) if told else None
    occupancy = arrays['occupancy']
    if occupancy.shape != (side,) * 3 or not (
            (occupancy >= 0) & (occupancy <= 1)).all():
        raise ValueError(f'occupancies of {occupancy.shape}, not all of them in [0, 1]')
    return SavedState(
        Progress(state, int(facts['views']), tuple(seen), evidence),
        Reconstruction(VoxelGrid(occupancy, reconstructor.object_size), arrays['latent'], None,
                       judge=lambda: quality),
        photos, Camera(arrays['last_pose']))


def _is_as(shape: Sequence[int], first: Sequence[int]) -> bool:
    """Return whether a state's shape is that before any view, or grew with the views from 0."""
    return len(shape) == len(first) and all(
        length == own or own == 0 for length, own in zip(shape, first, strict=True))


def _written_cameras(name: str, cameras: Sequence[Camera]) -> dict[str, NDArray[np.float64]]:
    lenses = [[getattr(camera.intrinsics, part) for part in _LENS] for camera in cameras]
    return {f'{name}_poses': np.array([camera.pose for camera in cameras]).reshape(-1, 4, 4),
            f'{name}_lenses': np.array(lenses, np.float64).reshape(-1, len(_LENS))}


def _read_cameras(name: str, arrays: Mapping[str, NDArray[Any]]) -> list[Camera]:
    lenses = [Intrinsics(fx, fy, cx, cy, int(width), int(height))
              for fx, fy, cx, cy, width, height in arrays[f'{name}_lenses'].tolist()]
    return [Camera(pose, lens)
            for pose, lens in zip(arrays[f'{name}_poses'], lenses, strict=True)]
