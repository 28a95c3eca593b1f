"""Views that the planner cannot use, in its diagnostics: the loop stands still at such a view."""

from collections.abc import Iterator
from contextlib import contextmanager

from active_recon.errors import ActiveReconError
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.run import one_line
from active_recon.policies.checked import FAULT

NO_GOAL = 'no_goal'
"""The warning that stays until a view is followed by a goal, or by the end of the episode."""


@contextmanager
def refusing_views(diagnostics: Diagnostics) -> Iterator[None]:
    """Reject the view, or the part of one, on which the block raises, and warn of its goal."""
    try:
        yield
    except ActiveReconError as error:
        diagnostics.reject(error)
        remedy = ('mend the policy, or set another, which then chooses'
                  if error.kind == FAULT else
                  'weights, object_size and object_frame must be those of the reconstructor')
        diagnostics.raise_warning(
            NO_GOAL, f'no goal after the last view: {one_line(error)}; {remedy}')
