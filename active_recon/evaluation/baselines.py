"""Two baselines that use no detail of an image: the mean shape and the nearest training image."""

from dataclasses import dataclass

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.metrics import THRESHOLDS
from active_recon.volumes.voxels import iou
import cv2
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_THUMBNAIL = 16  # pixels a side


@dataclass(frozen=True, eq=False)
class Baselines:
    """Both baselines for a training set; `threshold` is that of the mean shape."""

    training: ViewSet
    means: dict[str, Tensor]
    threshold: float

    @classmethod
    def of(cls, training: ViewSet, validation: ViewSet) -> 'Baselines':
        """Return the baselines with the threshold of the highest mean IoU on `validation`."""
        means = category_means(training)
        threshold = max(THRESHOLDS, key=lambda at: mean_shape_iou(
            means, validation, float(at)).mean())
        return cls(training, means, float(threshold))

    def mean_shape(self, views: ViewSet) -> NDArray[np.float64]:
        """Return the IoU of each object with its category's mean shape, (N,) in [0, 1]."""
        return mean_shape_iou(self.means, views, self.threshold)

    def nearest_image(self, views: ViewSet, objects: Tensor,
                      starts: Tensor) -> NDArray[np.float64]:
        """Return the IoU of episodes with the training shape of the nearest image, (E,)."""
        return nearest_image_iou(self.training, views, objects, starts)


def category_means(training: ViewSet) -> dict[str, Tensor]:
    """Return the mean occupancy (X, Y, Z) of each training category, and of all under ''."""
    names = training.categories
    means = {str(name): training.voxels[torch.from_numpy(names == name)].float().mean(dim=0)
             for name in np.unique(names)}
    return means | {'': training.voxels.float().mean(dim=0)}


def mean_shape_iou(means: dict[str, Tensor], views: ViewSet,
                   threshold: float) -> NDArray[np.float64]:
    """
    Return the IoU of each object with its category's mean shape above a threshold, (N,).

    Unlike a network, this baseline uses the true category; an unknown one gets the mean of all.
    """
    return np.array([
        float(iou(means.get(str(name), means['']) > threshold, truth))
        for name, truth in zip(views.categories, views.voxels, strict=True)])


def thumbnails(views: ViewSet) -> NDArray[np.float32]:
    """Return every image, RGBA, resampled to 16 x 16 and flattened, (N, V, 1024) in [0, 1]."""
    objects, count = views.images.shape[:2]
    flat = views.images.numpy().reshape(objects * count, *views.images.shape[2:])
    small = np.stack([cv2.resize(image, (_THUMBNAIL, _THUMBNAIL), interpolation=cv2.INTER_AREA)
                      for image in flat])
    return small.reshape(objects, count, -1).astype(np.float32) / np.float32(255)


def nearest_image_iou(training: ViewSet, views: ViewSet, objects: Tensor, starts: Tensor,
                      batch: int = 256) -> NDArray[np.float64]:
    """
    Return the IoU of each episode's object with the training shape of the nearest image, (E,).

    `objects` and `starts`, (E,), are the object and the first view of each episode. The image of
    the first view is compared with all training images by Euclidean distance of thumbnails.
    """
    known = thumbnails(training)
    owners = np.repeat(np.arange(len(training)), known.shape[1])
    library = torch.from_numpy(known.reshape(-1, known.shape[-1]))
    library_norm = library.square().sum(dim=1)
    asked = torch.from_numpy(thumbnails(views)[objects.numpy(), starts.numpy()])
    values = np.empty(len(objects))
    for low in range(0, len(objects), batch):
        part = slice(low, low + batch)
        nearest = (library_norm - 2 * asked[part] @ library.T).argmin(dim=1).numpy()
        values[part] = iou(training.voxels[torch.from_numpy(owners[nearest])],
                           views.voxels[objects[part]]).numpy()
    return values
