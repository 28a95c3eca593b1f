"""The parameters that tell the object from the room behind it."""

from dataclasses import dataclass

from active_recon.acquisition.background import (
    Background,
    BACKGROUNDS,
    COLOR_TOLERANCE,
    GREEN_SCREEN,
)
from active_recon.parameters.declaration import parameter


@dataclass(frozen=True)
class BackgroundSettings:
    """Of a node that takes the background away."""

    background: str = parameter(
        'as_is', 'what becomes white behind the object: nothing, what camera/mask says, what was '
        'there when capture_background was called, or what is of background_color',
        choices=BACKGROUNDS)
    background_color: tuple[int, ...] = parameter(
        GREEN_SCREEN, "the background's red, green and blue", low=0, high=255, changeable=True)
    background_tolerance: float = parameter(
        COLOR_TOLERANCE, 'CIE Lab distance of colors that still are the background', low=0.1,
        high=200.0, changeable=True)

    def as_background(self) -> Background:
        """Return them as the core knows them; raises ConfigError as it does."""
        return Background(self.background, self.background_color, self.background_tolerance)
