"""Images to feature maps and foreground logits, at the resolutions that are lifted."""

import math
from typing import NamedTuple, Self

from active_recon.models.border import (
    border_distance,
    border_evenness,
    seen_pixels,
    share_apart,
)
import torch
from torch import nn, Tensor
from torch.nn import functional

IMAGE_SIZE = 128
SHOWN = 6
"""Channels of what an encoder is shown; see `shown_channels`."""
COARSE, FINE = 32, 64
"""Pixels a side of the two maps."""
NO_EVIDENCE = 6.0
"""The foreground's logit where the camera saw nothing: no cell is carved there."""
_TRUST = 4.0
_AT_128 = 8  # channels: more would take longer than all that is narrower


class Maps(NamedTuple):
    """
    Feature maps of the images of B views.

    - coarse: (B, C, 32, 32) and fine: (B, c, 64, 64), features
    - seen: (B, 1, 64, 64) in [0, 1], the fraction of each pixel that the camera saw
    - foreground: (B, 1, 128, 128) logits
    """

    coarse: Tensor
    fine: Tensor
    seen: Tensor
    foreground: Tensor

    def packed(self) -> Tensor:
        """Return all of it as (B, F)."""
        return torch.cat([part.flatten(1) for part in self], dim=1)

    @torch.no_grad()
    def shown(self) -> Tensor:
        """Return the foreground's probability and `seen`, (B, 2, 64, 64) in [0, 1]."""
        share = functional.avg_pool2d(self.foreground.float().sigmoid(), 2)
        return torch.cat([share, self.seen.float()], dim=1)

    @classmethod
    def unpacked(cls, packed: Tensor, coarse: int, fine: int) -> Self:
        """Return the maps that were packed, of so many channels."""
        shapes = ((coarse, COARSE), (fine, FINE), (1, FINE), (1, IMAGE_SIZE))
        parts = torch.split(packed, [channels * side * side for channels, side in shapes], dim=1)
        return cls(*(part.reshape(-1, channels, side, side)
                     for part, (channels, side) in zip(parts, shapes, strict=True)))


class Norm(nn.GroupNorm):
    """Group normalisation of maps whose channels are last: as fast as where they are first."""

    def __init__(self, channels: int) -> None:
        super().__init__(math.gcd(8, channels), channels)

    def forward(self, maps: Tensor) -> Tensor:
        """Return maps of the same shape."""
        return super().forward(maps.contiguous()).contiguous(memory_format=torch.channels_last)


class Residual(nn.Module):
    """Two 3 x 3 convolutions beside the identity."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv2d(channels, channels, 3, padding=1), Norm(channels), nn.ReLU(),
            nn.Conv2d(channels, channels, 3, padding=1), Norm(channels))

    def forward(self, maps: Tensor) -> Tensor:
        """Return maps of the same shape."""
        return functional.relu(maps + self.layers(maps))


def shown_channels(images: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """
    Return what an encoder is shown of images (B, 3 or 4, S, S) in [0, 1], (B, 6, S, S).

    These are colours in [-1, 1], which pixels were seen, the distance from the border's colour,
    and the foreground by it; the second and the fourth are also returned by themselves.
    """
    seen = seen_pixels(images)
    apart = border_distance(images)
    # One half where the border has no single colour and says nothing of the background
    plain = 0.5 + border_evenness(apart, images) * (share_apart(apart, seen) - 0.5)
    shown = torch.cat([(2 * images[:, :3] - 1) * seen, seen, apart * seen, plain], dim=1)
    return shown.contiguous(memory_format=torch.channels_last), seen, plain


def _halved(before: int, after: int, kernel: int = 3) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(before, after, kernel, stride=2, padding=kernel // 2),
                         Norm(after), nn.ReLU())


class DownwardPath(nn.Module):
    """
    An encoder's way from what it is shown down to 8 pixels a side, and over all of it.

    `depth` is the number of residual blocks at 16 and at 8 pixels a side.
    """

    def __init__(self, channels: tuple[int, int, int, int], depth: int = 1) -> None:
        super().__init__()
        at_64, at_32, at_16, at_8 = channels
        # No norm where the maps are wide: it would take longer than what it follows
        self.down_64 = nn.Sequential(nn.Conv2d(SHOWN, at_64, 5, stride=2, padding=2), nn.ReLU(),
                                     nn.Conv2d(at_64, at_64, 3, padding=1), nn.ReLU())
        self.down_32 = nn.Sequential(_halved(at_64, at_32), Residual(at_32))
        self.down_16 = nn.Sequential(_halved(at_32, at_16),
                                     *(Residual(at_16) for _ in range(depth)))
        self.down_8 = nn.Sequential(_halved(at_16, at_8),
                                    *(Residual(at_8) for _ in range(depth)))
        self.whole = nn.Linear(at_8, at_8)

    def downward(self, shown: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Return the maps of (B, 6, 128, 128) at 64, 32, 16 and 8 pixels a side."""
        at_64 = self.down_64(shown)
        at_32 = self.down_32(at_64)
        at_16 = self.down_16(at_32)
        at_8 = self.down_8(at_16)
        return at_64, at_32, at_16, at_8 + self.whole(at_8.mean(dim=(2, 3)))[:, :, None, None]


class PyramidEncoder(DownwardPath):
    """
    A pyramid down to 8 x 8 and up again, with lateral connections at 16, 32 and 64.

    `channels` are those at 64, 32, 16 and 8 pixels a side; `width` those of the way up at 16 and
    32, half of them at 64. `coarse` and `fine` are the channels of the maps. For `depth` see
    DownwardPath.
    """

    def __init__(self, channels: tuple[int, int, int, int], width: int, coarse: int,
                 fine: int, depth: int = 1) -> None:
        super().__init__(channels, depth)
        at_64, at_32, at_16, at_8 = channels
        self.up_8 = nn.Conv2d(at_8, width, 1)
        self.lateral_16, self.lateral_32 = nn.Conv2d(at_16, width, 1), nn.Conv2d(at_32, width, 1)
        self.smooth_16, self.smooth_32 = _smooth(width), _smooth(width)
        half = width // 2
        self.up_32, self.lateral_64 = nn.Conv2d(width, half, 1), nn.Conv2d(at_64, half, 1)
        self.smooth_64 = _smooth(half)
        self.silhouette = nn.Conv2d(half, 4 * _AT_128, 1)
        self.shown_128 = nn.Conv2d(SHOWN, _AT_128, 3, padding=1)
        # Learned logits, and the weight of the difference from the border's colour
        self.foreground = nn.Conv2d(2 * _AT_128, 2, 3, padding=1)
        self.foreground.bias = nn.Parameter(torch.tensor([0.0, _TRUST]))
        self.coarse, self.fine = nn.Conv2d(width + 1, coarse, 1), nn.Conv2d(half + 4, fine, 1)

    def forward(self, images: Tensor) -> Maps:
        """Return the maps of images (B, 3, 128, 128), or (B, 4, ...) with the mask of `seen`."""
        shown, seen, plain = shown_channels(images)
        at_64, at_32, at_16, at_8 = self.downward(shown)
        up_16 = self.smooth_16(_doubled(self.up_8(at_8)) + self.lateral_16(at_16))
        up_32 = self.smooth_32(_doubled(up_16) + self.lateral_32(at_32))
        up_64 = self.smooth_64(_doubled(self.up_32(up_32)) + self.lateral_64(at_64))
        at_128 = torch.cat([functional.pixel_shuffle(self.silhouette(up_64), 2),
                            self.shown_128(shown)], dim=1)
        learned, trust = self.foreground(functional.relu(at_128)).split(1, dim=1)
        silhouette = learned + functional.softplus(trust) * (2 * plain - 1)  # (B, 1, 128, 128)
        share = silhouette.sigmoid()
        coarse = self.coarse(torch.cat([up_32, functional.avg_pool2d(share, 4)], dim=1))
        fine = self.fine(torch.cat([up_64, functional.pixel_unshuffle(share, 2)], dim=1))
        silhouette = torch.where(seen > 0.5, silhouette,
                                 torch.full_like(silhouette, NO_EVIDENCE))
        return Maps(coarse, fine, functional.avg_pool2d(seen, 2).to(fine.dtype), silhouette)


def _smooth(channels: int) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(channels, channels, 3, padding=1), nn.ReLU())


def _doubled(maps: Tensor) -> Tensor:
    return functional.interpolate(maps, scale_factor=2.0, mode='nearest')
