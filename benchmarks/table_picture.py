r"""
The picture of what a table tells about photos.

    PYTHONPATH=test python -m benchmarks.table_picture --out docs/images/table.png

A CC0 model that ships stands on a newspaper before clutter. Of two of its eight photos are shown:
the photo around the object, what the segmenter finds in it, what the table tells (red: something
above it, blue: the table, white: nothing), and what all photos agree on by both.
"""

import argparse
from pathlib import Path

from active_recon.photos.cube import Cube, MARGIN
from active_recon.photos.ground import Ground
from active_recon.photos.segmented_views import agreed_shares, seen_photo
from active_recon.photos.table_evidence import above_table
from active_recon.segmentation import shipped_segmentation
from active_recon.volumes.meshes import load_mesh
from benchmarks.photos_on_tables import MODELS, SIZE
from matplotlib.figure import Figure
import numpy as np
from photo_table import around, centred, photographed, PRINT

_MODEL = 'lamp/quaternius-interior__Light_Floor1.glb'
_VIEWS, _SHOWN = 8, (0, 3)
_UP = np.array([0.0, 0.0, 1.0])
_TITLES = ('photo', 'segmenter', 'table', 'together')
_MOST = 4.0  # log odds that count


def main() -> None:
    """Write the picture."""
    parser = argparse.ArgumentParser(description='What a table tells about photos.')
    parser.add_argument('--out', type=Path, default=Path('table.png'))
    parser.add_argument('--model', default=_MODEL, help='below benchmarks/real_cc0')
    options = parser.parse_args()
    mesh = centred(load_mesh(MODELS / options.model), SIZE)
    rng = np.random.default_rng(0)
    cameras = around(_VIEWS, 3 * SIZE, rng)
    images, _ = photographed(mesh, cameras, PRINT, rng)
    cube = Cube(np.zeros(3), MARGIN * SIZE, _UP)
    table = Ground(_UP, float(mesh.bounds[0, 2])).within(cube)
    segmentation = shipped_segmentation()
    framed = [segmentation.framed(image, cube.camera(camera, 1.0))
              for image, camera in zip(images, cameras, strict=True)]
    told = above_table([seen_photo(each) for each in framed], table)
    agreed = agreed_shares(framed, table)
    figure = Figure(figsize=(8, 4.2), layout='constrained')
    places = figure.subplots(len(_SHOWN), len(_TITLES))
    for row, number in zip(places, _SHOWN, strict=True):
        row[0].imshow(framed[number].image[..., :3])
        row[1].imshow(framed[number].shares, cmap='gray', vmin=0, vmax=1)
        row[2].imshow(told[number], cmap='bwr', vmin=-_MOST, vmax=_MOST)
        row[3].imshow(agreed[number], cmap='gray', vmin=0, vmax=1)
        for place in row:
            place.set_axis_off()
    for place, title in zip(places[0], _TITLES, strict=True):
        place.set_title(title)
    figure.savefig(options.out, dpi=120)


if __name__ == '__main__':
    main()
