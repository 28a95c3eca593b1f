"""The parameters of the player."""

from dataclasses import dataclass

from active_recon.parameters.declaration import parameter


@dataclass(frozen=True)
class PlayerSettings:
    """What the player is told."""

    bag: str = parameter('', 'the bag to play')
    rate: float = parameter(1.0, 'how much faster than it was recorded')
    topics: str = parameter('', 'those to play, with commas between; empty for all')
