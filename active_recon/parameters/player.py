"""The parameters of the player."""

from dataclasses import dataclass

from active_recon.parameters.declaration import parameter


@dataclass(frozen=True)
class PlayerParameters:
    """Parameters of the player."""

    bag: str = parameter('', 'bag to play', path=True)
    rate: float = parameter(1.0, 'playback speed; 1 is that of the recording')
    topics: str = parameter('', 'topics to play, separated by commas; empty for all')
