"""Work on many items: in processes of this machine, or on the machines of a Ray cluster."""

from active_recon.cluster.crew import Crew, crew_of, map_items
from active_recon.cluster.results import Result

__all__ = ['Crew', 'Result', 'crew_of', 'map_items']
