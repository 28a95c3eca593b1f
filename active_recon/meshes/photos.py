"""The photographs of an episode that colour its surface: few, small, and spread over the views."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from active_recon.geometry.cameras import Camera
from active_recon.geometry.canonical import framed_layers, require_size
import numpy as np
from numpy.typing import NDArray

PHOTO_SIDE = 256
"""Side of a kept photograph, pixels: about one for each corner of a mesh of 128 cells a side."""
MOST_PHOTOS = 24
"""Photographs that are kept of an episode, 5 MB together."""


@dataclass(frozen=True, eq=False)
class Photo:
    """
    An image and the camera that took it, in the object frame.

    `image` is (H, W, 3) uint8 RGB or (H, W, 4), whose fourth channel is 0 where nothing is known.
    Raises ViewError where it is another array, or of another size than the camera's.
    """

    image: NDArray[np.uint8]
    camera: Camera

    def __post_init__(self) -> None:
        """Reject other arrays."""
        require_size(self.image, self.camera, (3, 4))

    @classmethod
    def of(cls, image: NDArray[np.uint8], camera: Camera, object_size: float,
           side: int = PHOTO_SIDE) -> 'Photo':
        """
        Return the part of an image (H, W, 3) around the object's cube, `side` pixels wide.

        `object_size` is the cube's side in metres; what the image does not hold is unknown.
        """
        framed, held, target = framed_layers(image, camera, object_size, side)
        return cls(framed if held.all() else np.dstack([framed, held * np.uint8(255)]), target)


class Album:
    """
    The photographs of an episode, at most `most`.

    If there are more, the earlier one of the two whose cameras are nearest in direction leaves.
    """

    def __init__(self, most: int = MOST_PHOTOS) -> None:
        self._most = most
        self._photos: list[Photo] = []

    @property
    def photos(self) -> Sequence[Photo]:
        """The photographs in the order in which they were taken."""
        return tuple(self._photos)

    def add(self, photo: Photo) -> None:
        """Keep a photograph, in the place of another if there are too many."""
        self._photos.append(photo)
        if len(self._photos) > self._most:
            directions = np.array([each.camera.direction for each in self._photos])
            alike = np.triu(directions @ directions.T, 1) - np.tri(len(directions))
            del self._photos[int(np.unravel_index(alike.argmax(), alike.shape)[0])]

    def clear(self) -> None:
        """Forget all photographs."""
        self._photos.clear()


def album_of(views: Iterable[tuple[NDArray[np.uint8], Camera]], object_size: float) -> Album:
    """Return the album of images (H, W, 3) uint8 and their cameras; `object_size` in metres."""
    album = Album()
    for image, camera in views:
        album.add(Photo.of(image, camera, object_size))
    return album
