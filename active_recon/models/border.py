"""The background's colour from an image's border, and the foreground that differs from it."""

import torch
from torch import Tensor
from torch.nn import functional

_NEARLY, _CLEARLY = 0.015, 0.045  # distances of a colour from the background's, in [0, 1]
_CONTRAST = 0.1  # the least distance of an object's colour at whose edge pixels are shared
_SCATTERED, _EVEN = 0.35, 0.7  # fractions of the border that are nearly of one colour
_HALVINGS = 8  # of the range of a colour: to one grey level of 256


def foreground(images: Tensor) -> Tensor:
    """
    Return the foreground of images (B, 3 or 4, S, S) by their borders' colour, (B, 1, S, S).

    0 is background, 1 foreground. A fourth channel is the mask of seen pixels; others are 1.
    """
    return share_apart(border_distance(images), seen_pixels(images))


def share_apart(distance: Tensor, seen: Tensor) -> Tensor:
    """
    Return the foreground of colour distances, in [0, 1]; 1 where nothing was seen.

    A pixel between background and a distinct colour is a mixture of both: its share of the
    foreground is its distance over the largest among it and its eight neighbours.
    """
    share = ((distance - _NEARLY) / (_CLEARLY - _NEARLY)).clamp(0, 1)
    most = largest_around(distance * seen, 3)
    least = -largest_around(-torch.where(seen > 0.5, distance, 1.0), 3)
    at_edge = (least < _NEARLY) & (most > _CONTRAST)
    share = torch.where(at_edge, torch.minimum(share, distance / most.clamp(min=_CONTRAST)), share)
    return torch.where(seen > 0.5, share, 1.0)


def seen_pixels(images: Tensor) -> Tensor:
    """Return the fourth channel of images (B, 3 or 4, S, S), or 1 where there is none."""
    return images[:, 3:] if images.shape[1] == 4 else torch.ones_like(images[:, :1])


def border_distance(images: Tensor) -> Tensor:
    """
    Return the largest difference of a channel from the border's median, (B, 1, S, S) in [0, 1].

    The border is two pixels wide, along the end of what was seen.
    """
    behind = _median(images[:, :3].float().flatten(2), _border(images).flatten(2))
    return (images[:, :3] - behind[..., None]).abs().amax(dim=1, keepdim=True)


def border_evenness(distance: Tensor, images: Tensor) -> Tensor:
    """
    Return how well a border's colour represents the background, (B, 1, 1, 1) in [0, 1].

    1 where most of the border has the colour from which `distance` is measured; 0 in clutter.
    """
    border = _border(images)
    count = border.sum(dim=(2, 3), keepdim=True)
    even = ((distance < _CLEARLY) * border).sum(dim=(2, 3), keepdim=True) / count.clamp(min=1)
    return ((even - _SCATTERED) / (_EVEN - _SCATTERED)).clamp(0, 1)


def largest_around(maps: Tensor, side: int) -> Tensor:
    """Return the largest of the square around each pixel of maps (B, C, S, S); `side` is odd."""
    # A square is the same along one axis and then the other, in less time
    half = side // 2
    return functional.max_pool2d(
        functional.max_pool2d(maps, (side, 1), 1, (half, 0)), (1, side), 1, (0, half))


def _border(images: Tensor) -> Tensor:
    """Return 1 along the edge of the seen pixels, two pixels wide, else 0, (B, 1, S, S)."""
    seen = seen_pixels(images) > 0.5
    inner = -largest_around(-seen.float(), 5)
    padded = functional.pad(inner[:, :, 2:-2, 2:-2], (2, 2, 2, 2))
    return (seen & (padded < 0.5)).float()


def _median(values: Tensor, weights: Tensor) -> Tensor:
    """
    Return the medians of values (B, C, N) in [0, 1] of weight 1, (B, C, 1); 1 where none is.

    By bisection, since exported graphs cannot sort.
    """
    half = weights.sum(dim=2, keepdim=True) / 2
    high = torch.ones_like(values[:, :, :1])
    for halving in range(1, _HALVINGS + 1):
        lower = high - 0.5 ** halving
        below = ((values <= lower) * weights).sum(dim=2, keepdim=True)
        high = torch.where((below >= half) & (half > 0), lower, high)
    return high
