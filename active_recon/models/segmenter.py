"""The object's silhouette in an image of its cube, before any background."""

from dataclasses import dataclass

from active_recon.config import Config
from active_recon.errors import ConfigError
from active_recon.models.lifting_encoder import (
    DownwardPath,
    Norm,
    SHOWN,
    shown_channels,
)
import torch
from torch import nn, Tensor
from torch.nn import functional


@dataclass(frozen=True)
class SegmenterConfig(Config):
    """
    Sizes of the segmenter.

    - channels: on the way down, at 64, 32, 16 and 8 pixels a side
    - up_channels: on the way up, at 128, 64, 32 and 16 pixels a side
    """

    channels: tuple[int, int, int, int] = (16, 48, 96, 160)
    up_channels: tuple[int, int, int, int] = (16, 32, 48, 96)

    def __post_init__(self) -> None:
        """Reject sizes that make no network."""
        if min(*self.channels, *self.up_channels) < 1:
            raise ConfigError('SegmenterConfig: invalid channels: expected 1 or more, got '
                              f'{self.to_dict()}')


class Segmenter(DownwardPath):
    """
    A U-Net from 128 to 8 pixels a side: what of an image around the object's cube is the object.

    It looks at one image alone. Ronneberger et al., "U-Net", MICCAI 2015; the way down is that of
    the lifting network's `PyramidEncoder`, whose weights it may begin with.
    """

    def __init__(self, channels: tuple[int, int, int, int],
                 up_channels: tuple[int, int, int, int]) -> None:
        super().__init__(channels)
        at_64, at_32, at_16, at_8 = channels
        up_128, up_64, up_32, up_16 = up_channels
        self.shown_128 = nn.Sequential(nn.Conv2d(SHOWN, up_128, 3, padding=1), nn.ReLU())
        self.up_16 = _Up(at_8, at_16, up_16)
        self.up_32 = _Up(up_16, at_32, up_32)
        self.up_64 = _Up(up_32, at_64, up_64)
        self.up_128 = _Up(up_64, up_128, up_128)
        self.last = nn.Conv2d(up_128, 1, 3, padding=1)

    @classmethod
    def from_config(cls, config: SegmenterConfig) -> 'Segmenter':
        """Build the segmenter of a configuration, with fresh weights."""
        return cls(config.channels, config.up_channels)

    def begin_with(self, encoder: DownwardPath) -> None:
        """Take over an encoder's way down; raises RuntimeError where its sizes differ."""
        for name in ('down_64', 'down_32', 'down_16', 'down_8', 'whole'):
            getattr(self, name).load_state_dict(getattr(encoder, name).state_dict())

    def forward(self, images: Tensor) -> Tensor:
        """
        Return the object's logits, (B, 1, 128, 128), of images (B, 3 or 4, 128, 128) in [0, 1].

        A fourth channel is 1 where the camera saw the pixel; the logits of others mean nothing.
        """
        shown, _, _ = shown_channels(images)
        at_64, at_32, at_16, at_8 = self.downward(shown)
        up_64 = self.up_64(self.up_32(self.up_16(at_8, at_16), at_32), at_64)
        found: Tensor = self.last(self.up_128(up_64, self.shown_128(shown)))
        return found


class _Up(nn.Module):
    """Maps of twice the side, from those below and what the way down had at that side."""

    def __init__(self, below: int, beside: int, after: int) -> None:
        super().__init__()
        self.finer = nn.Conv2d(below, 4 * after, 1)
        self.merge = nn.Sequential(
            nn.Conv2d(after + beside, after, 3, padding=1), Norm(after), nn.ReLU(),
            nn.Conv2d(after, after, 3, padding=1), nn.ReLU())

    def forward(self, below: Tensor, beside: Tensor) -> Tensor:
        """Return the maps, (B, after, 2 S, 2 S)."""
        finer = functional.relu(functional.pixel_shuffle(self.finer(below), 2))
        merged: Tensor = self.merge(torch.cat([finer, beside], dim=1))
        return merged
