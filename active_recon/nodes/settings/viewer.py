"""The parameters of the viewer."""

from dataclasses import dataclass

from active_recon.nodes.parameters import parameter
from active_recon.nodes.settings.shared import CubeSettings
from active_recon.viewer.address import DEFAULT_PORT, HIGHEST_PORT


@dataclass(frozen=True)
class ViewerSettings(CubeSettings):
    """What the viewer is told."""

    port: int = parameter(
        DEFAULT_PORT, 'where the page is served, if it is free; 0 for any that is',
        low=0, high=HIGHEST_PORT)
