"""A retrieval baseline for posed views: the training shape with the nearest image."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from active_recon.datasets.layout import ObjectFolder
from active_recon.datasets.views import read_views
from active_recon.evaluation.baselines import thumbnails
from active_recon.evaluation.posed.scene import IMAGE_SIZE, Scene
from active_recon.evaluation.posed.scoring import Scores
from active_recon.volumes.voxels import iou, RESOLUTION, turned
import numpy as np
from numpy.typing import NDArray

_AT_ONCE = 64  # objects in memory


@dataclass(frozen=True, eq=False)
class Library:
    """
    The training images to retrieve from.

    - folders: the objects
    - images: thumbnails of all views of all objects, (M, 1024)
    - azimuths: of their cameras, radians, (M,)
    - owners: index of the object in `folders`, (M,)
    - unreadable: why other objects were left out
    """

    folders: Sequence[ObjectFolder]
    images: NDArray[np.float32]
    azimuths: NDArray[np.float64]
    owners: NDArray[np.int64]
    unreadable: Sequence[str] = ()

    def nearest(self, asked: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the rows (E,) of the images nearest to thumbnails (E, 1024)."""
        norms = np.square(self.images).sum(axis=1)
        return np.asarray((norms - 2 * asked @ self.images.T).argmin(axis=1))


def read_library(folders: Sequence[ObjectFolder],
                 advance: Callable[[int], None] = lambda done: None) -> Library:
    """Read the framed images of objects as thumbnails; raises DataError as `read_views` does."""
    kept: list[ObjectFolder] = []
    unreadable: list[str] = []
    images, azimuths, owners = [], [], []
    for low in range(0, len(folders), _AT_ONCE):
        views = read_views(folders[low:low + _AT_ONCE], lambda: advance(1), RESOLUTION, IMAGE_SIZE,
                           framed=True)
        unreadable += views.unreadable
        small = thumbnails(views)
        images.append(small.reshape(-1, small.shape[-1]))
        azimuths.append(views.azimuths.double().numpy().ravel())
        owners.append(len(kept) + np.repeat(np.arange(len(views)), small.shape[1]))
        kept += views.folders
    return Library(kept, np.concatenate(images), np.concatenate(azimuths), np.concatenate(owners),
                   unreadable)


def nearest_image_scores(library: Library, scene: Scene,
                         chosen: NDArray[np.int64]) -> list[Scores]:
    """
    Return the IoU of each object with the training shape nearest to its view `chosen` (N,).

    Objects may have any yaw, so the shape is rotated until both cameras have the same azimuth; a
    difference in elevation is not corrected.
    """
    rows = np.arange(len(scene))
    nearest = library.nearest(thumbnails(scene.views)[rows, chosen])
    azimuths = scene.views.azimuths.double().numpy()[rows, chosen]
    found = []
    for row, place in enumerate(nearest):
        folder = library.folders[library.owners[place]]
        yaw = float(azimuths[row] - library.azimuths[place])
        scores = {}
        for side, truth in scene.truths.items():
            if not folder.voxels_path(side).is_file():
                continue
            shape = turned(folder.voxels(side).occupancy, 0.0 if abs(yaw) < 1e-6 else yaw)
            scores[f'iou_{side}'] = float(iou(shape > 0.5, truth[row].numpy()))
        found.append(scores)
    return found
