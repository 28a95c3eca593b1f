"""The parameters of the background's removal."""

from dataclasses import dataclass

from active_recon.acquisition.background import (
    Background,
    BACKGROUNDS,
    COLOR_TOLERANCE,
    GREEN_SCREEN,
)
from active_recon.parameters.declaration import parameter


@dataclass(frozen=True)
class BackgroundParameters:
    """Parameters of a node that removes the background."""

    background: str = parameter(
        'as_is', 'which pixels become white: none (as_is), those that are not the object to a '
        'learned segmenter (segment), those outside camera/mask, those that equal the image of '
        'capture_background, or those of background_color',
        choices=BACKGROUNDS)
    segmenter: str = parameter(
        '', 'weights file of the segmenter (.safetensors); empty: the one that ships', path=True)
    background_color: tuple[int, ...] = parameter(
        GREEN_SCREEN, 'RGB color of the background', low=0, high=255, dynamic=True)
    background_tolerance: float = parameter(
        COLOR_TOLERANCE, 'largest CIE Lab distance from the color of the background', low=0.1,
        high=200.0, dynamic=True)

    def as_background(self) -> Background:
        """Return the background as the core takes it; raises ConfigError as `Background` does."""
        return Background(self.background, self.background_color, self.background_tolerance)
