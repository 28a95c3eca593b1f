r"""
`active-recon reconstruct` on photographs of a real object, and on photos of rendered ones.

    PYTHONPATH=test python -m benchmarks.photos photos/dino_sparse_ring \
        --out docs/results/photos.json

The photographs are Middlebury's dinoSparseRing, as downloaded. Their shape is compared with the
visual hull of all 16 masks at 32 cells a side, from five photos at even steps that begin with any
of them, and the command is timed as a user runs it. Rendered photos are of the CC0 models that
ship, before plain backgrounds of many colours with noise and uneven light; they tell what each way
to treat a background is worth where the truth is known. Others stand on a printed board before
clutter, whose lens and poses are found from the photos, beside true masks and true poses; then as
a phone in the hand takes them: rolling exposure, blur, JPEG 80. Others stand on a table with a
pattern, where poses are known and masks are not, and the cube is told or found.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import json
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import Any

from active_recon.datasets.middlebury import PosedPhotographs, read_photographs
from active_recon.errors import ActiveReconError
from active_recon.evaluation.posed.photographs import averaged, EVEN, even_views, hull
from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.models.weights_files import DEFAULT_MODEL, SMALL_MODEL
from active_recon.photos.camera_file import CameraFile
from active_recon.photos.options import Options
from active_recon.photos.reconstruct import from_views, reconstruct
from active_recon.photos.shape import Shape
from active_recon.photos.sources import BoardCameras
from active_recon.photos.views import PhotoView
from active_recon.volumes.meshes import load_mesh
from active_recon.volumes.rendering import Renderer
from active_recon.volumes.voxelisation import voxelise
from active_recon.volumes.voxels import iou
from benchmarks.photographed_grounds import ground_table, grounds
from benchmarks.photos_on_tables import interval, MODELS, on_tables, SIZE, some_models
from benchmarks.studies import with_tables_between_marks
import numpy as np
from numpy.typing import NDArray
from phone_photos import as_of_a_phone
from photo_board import around, photographed, standing
from PIL import Image
from rendered_boards import BOARD

WAYS = ('auto', 'plain', 'network')
_LENS = Intrinsics(700, 700, 320, 240, 640, 480)
_GOAL = 0.8  # of the dinosaur, from the first photo on
_VIEWS = 5
_BOARD_VIEWS = 12
_PHONE_VIEWS = 8
Taken = Callable[[NDArray[np.uint8], np.random.Generator], NDArray[np.uint8]]
_EVERY = 3  # of the models that ship


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(description='Photos in, shapes out.')
    parser.add_argument('photos', type=Path, help='folder of dinoSparseRing')
    parser.add_argument('--runs', type=int, default=5, help='how often the command is timed')
    parser.add_argument('--objects', type=int, default=30, help='objects on the board')
    parser.add_argument('--model', default=DEFAULT_MODEL,
                        help='a model that ships, or a weights file')
    parser.add_argument('--out', type=Path, default=Path('photos.json'))
    parser.add_argument('--parts', nargs='*', default=[
        'photographs', 'command_s', 'rendered', 'board', 'phone', 'table', 'grounds'],
        help='others stay as they are')
    options = parser.parse_args()
    model = options.model
    measure = {'photographs': lambda: _photographs(options.photos, model),
               'command_s': lambda: _timed(options.photos, options.runs, model),
               'rendered': lambda: _rendered(model),
               'board': lambda: _on_board(options.objects, _BOARD_VIEWS, model),
               'phone': lambda: _on_board(options.objects, _PHONE_VIEWS, model, as_of_a_phone),
               'table': lambda: on_tables(options.objects, model),
               'grounds': lambda: grounds(options.objects)}
    result = json.loads(options.out.read_text()) if options.out.exists() else {}
    named = '' if model == DEFAULT_MODEL else f' --model {model}'
    result['command'] = ('PYTHONPATH=test python -m benchmarks.photos photos/dino_sparse_ring'
                         f'{named} --out docs/results/{options.out.name}')
    for part in options.parts:
        result[part] = measure[part]()
        options.out.write_text(json.dumps(result, indent=1) + '\n')


def table(result: Mapping[str, Any], faster: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of the table of doc/photos.md; `faster` was measured with SMALL_MODEL."""
    yield f'| what | IoU | with `--model {SMALL_MODEL}` | goal |'
    yield '|---|---|---|---|'
    for (what, told, goal), (_, other, _) in zip(_rows(result), _rows(faster), strict=True):
        yield f'| {what} | {told} | {other} | {goal} |'


def _rows(result: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield what was measured, the IoU, and the goal with whether it was reached."""
    taken, rendered, tables = (result[part] for part in ('photographs', 'rendered', 'table'))
    for way in WAYS:
        reached = 'reached' if taken[way][0] >= _GOAL else 'missed'
        yield (f'dinosaur, `--background {way}`, from the first photo on; from any, mean '
               '[least, greatest]', f'{taken[way][0]:.3f}; {np.mean(taken[way]):.3f} '
               f'[{min(taken[way]):.3f}, {max(taken[way]):.3f}]', f'{_GOAL:.2f}: {reached}')
    yield ('the same, hull of the five true masks',
           f'{taken["hull"][0]:.3f}; {np.mean(taken["hull"]):.3f}', '')
    for way, words in (('masks', 'true masks'), *((way, f'`--background {way}`') for way in WAYS)):
        yield (f'{len(rendered["objects"])} models before plain backgrounds, five photos, {words}',
               _told(rendered['iou'][way]), '')
    yield from _board_rows(result['board'], 'photos', 0.03)
    yield from _board_rows(result['phone'], 'photos as of a phone', 0.06)
    for way, told in tables['iou'].items():
        yield (f'{len(tables["objects"])} models on tables before clutter, {tables["views"]} '
               f'photos, {way}', _told(told), '')


def _board_rows(board: Mapping[str, Any], photos: str,
                within: float) -> Iterator[tuple[str, str, str]]:
    goal = board['iou']['true masks and poses']['mean'] - within
    reached = 'reached' if board['iou']['found']['mean'] >= goal else 'missed'
    for way, words in (('found', 'from the photos alone'), ('true masks', 'with true masks'),
                       ('true masks and poses', 'with true masks, lens and poses')):
        yield (f'{len(board["objects"])} models on a board before clutter, {board["views"]} '
               f'{photos}, {words}', _told(board['iou'][way]),
               f'within {within:.2f} of the row with all: {reached}' if way == 'found' else '')


def with_table(text: str, result: Mapping[str, Any], faster: Mapping[str, Any]) -> str:
    """Return a page with the tables between their marks."""
    return with_tables_between_marks(text, {
        'photos': lambda: table(result, faster),
        'grounds': lambda: ground_table(result['grounds'])})


def _told(interval: Mapping[str, float]) -> str:
    return f'{interval["mean"]:.3f} [{interval["low"]:.3f}, {interval["high"]:.3f}]'


def _photographs(folder: Path, model: str) -> dict[str, Any]:
    """Return the IoU by background: from the first photograph on, and over all first ones."""
    read = read_photographs(folder)
    truth = hull(read, range(len(read)))
    orders = [even_views(len(read), start, EVEN) for start in range(len(read))]
    found: dict[str, Any] = {'photographs': len(read), 'views': orders[0], 'hull': [
        float(iou(hull(read, order), truth)) for order in orders]}
    for way in WAYS:
        found[way] = [_score(read, order, way, truth, model) for order in orders]
        print(f'{way}: {found[way][0]:.3f}, mean {np.mean(found[way]):.3f}',  # noqa: T201
              file=sys.stderr, flush=True)
    return found


def _score(read: PosedPhotographs, order: Sequence[int], way: str, truth: Any,
           model: str) -> float:
    """Return the IoU of a reconstruction from some photographs, with the box of README.txt."""
    files = [read.folder / read.names[view] for view in order]
    shape = reconstruct(files, background=way, model=model)
    return float(iou(averaged(shape.occupancy, len(truth)) > shape.threshold, truth))


def _timed(folder: Path, runs: int, model: str) -> list[float]:
    """Return how long the command took each time, seconds."""
    took = []
    with TemporaryDirectory() as out:
        for _ in range(runs):
            start = time.perf_counter()
            subprocess.run([sys.executable, '-m', 'active_recon.cli.main', 'reconstruct',
                            str(folder), '--views', str(EVEN), '--out', out,
                            '--model', model],
                           check=True, capture_output=True)
            took.append(time.perf_counter() - start)
    return took


def _rendered(model: str) -> dict[str, Any]:
    """Return means over objects of the IoU at 64 cells by background, with intervals."""
    found: dict[str, list[float]] = {way: [] for way in ('masks', *WAYS)}
    files = sorted(MODELS.glob('*/*.glb'))[::_EVERY]
    for number, file in enumerate(files):
        for way, value in _of_model(file, number, model):
            found[way].append(value)
        print({way: round(values[-1], 3) for way, values in found.items()},  # noqa: T201
              file=sys.stderr, flush=True)
    return {'objects': [file.stem for file in files], 'views': _VIEWS,
            'iou': {way: interval(values) for way, values in found.items()}}


def _of_model(file: Path, seed: int, model: str) -> Iterator[tuple[str, float]]:
    mesh, rng = load_mesh(file), np.random.default_rng(seed)
    truth = voxelise(mesh, 64).occupied(0.5)
    renderer = Renderer(mesh)
    cameras = [orbit_camera(step * 2 * np.pi / _VIEWS + rng.uniform(0, 0.4),
                            rng.uniform(0.1, 0.7), 2.4, _LENS) for step in range(_VIEWS)]
    rgba = [renderer.render(camera) for camera in cameras]
    color = rng.integers(0, 256, 3)
    images = {'masks': rgba, **dict.fromkeys(WAYS, [_before(each, color, rng) for each in rgba])}
    for way, shown in images.items():
        shape = reconstruct(shown, cameras, 1.0, background='auto' if way == 'masks' else way,
                            model=model)
        yield way, float(iou(shape.occupancy > shape.threshold, truth))


def _before(rgba: Any, color: Any, rng: np.random.Generator) -> Any:
    """Return an image before a background with noise and light from aside, (H, W, 3) uint8."""
    height, width = rgba.shape[:2]
    across, down = rng.uniform(-10, 10, 2)
    light = (np.linspace(-0.5, 0.5, width) * across)[None] + (
        np.linspace(-0.5, 0.5, height) * down)[:, None]
    behind = color + light[..., None] + rng.normal(0, 2, (height, width, 3))
    alpha = rgba[..., 3:] / 255
    image = rgba[..., :3] * alpha + behind * (1 - alpha) + rng.normal(0, 2, (height, width, 1))
    return np.clip(image, 0, 255).astype(np.uint8)


def _on_board(count: int, views: int, model: str,
              taken: Taken = lambda image, rng: image) -> dict[str, Any]:
    """
    Return the IoU at 64 cells of objects on a board, by what is known, with intervals.

    `taken` makes what the camera stores of an image.
    """
    files = some_models(count)
    found: dict[str, list[float]] = {'found': [], 'true masks': [], 'true masks and poses': []}
    for number, file in enumerate(files):
        mesh = standing(load_mesh(file), SIZE)
        cameras = around(views, SIZE / 3, number)
        images, masks = photographed(mesh, cameras, number)
        rng = np.random.default_rng(number)
        images = [taken(image, rng) for image in images]
        with TemporaryDirectory() as folder:
            for view, (image, mask) in enumerate(zip(images, masks, strict=True)):
                for name, pixels in (('rgb', image), ('masked', np.dstack(
                        [image, mask * np.uint8(255)]))):
                    path = Path(folder, name, f'{view:02}.png')
                    path.parent.mkdir(exist_ok=True)
                    Image.fromarray(pixels).save(path)
            for way, name in (('found', 'rgb'), ('true masks', 'masked')):
                shape = _tried(Path(folder, name), model)
                found[way].append(0.0 if shape is None else _iou(shape, mesh))
        true = [PhotoView(str(view), image, camera, mask, 'masks') for view, (image, mask, camera)
                in enumerate(zip(images, masks, cameras, strict=True))]
        found['true masks and poses'].append(_iou(from_views(
            true, CameraFile('true', (), np.array([0.0, 0.0, 1.0])), Options(model=model)), mesh))
        print(file.stem, {way: round(values[-1], 3) for way, values in found.items()},  # noqa: T201
              file=sys.stderr, flush=True)
    return {'objects': [file.stem for file in files], 'views': views,
            'each': found, 'iou': {way: interval(values) for way, values in found.items()}}


def _tried(folder: Path, model: str) -> Shape | None:
    try:
        return reconstruct(folder, BoardCameras(BOARD), model=model)
    except ActiveReconError as error:
        print(f'nothing: {error}', file=sys.stderr)  # noqa: T201
        return None


def _iou(shape: Shape, mesh: Any) -> float:
    """Return the IoU with a mesh in the world of the cameras, in the shape's own cube."""
    placed = mesh.copy()
    placed.apply_transform(np.linalg.inv(shape.world_from_object))
    placed.apply_transform(np.diag([*[1 / shape.size] * 3, 1.0]))
    truth = voxelise(placed, len(shape.occupancy)).occupied(0.5)
    return float(iou(shape.occupancy > shape.threshold, truth))


if __name__ == '__main__':
    main()
