"""What runs a node's network, in its diagnostics."""

from collections.abc import Mapping

from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.runtimes import REMARK


def tell_of_runtime(diagnostics: Diagnostics, provenance: Mapping[str, str],
                    fact: str = 'Runtime') -> None:
    """
    Tell what runs a network, and warn with the reason where it is not what was preferred.

    `fact` names it in the diagnostics, and the warning in lower case.
    """
    diagnostics.set_value(fact, provenance.get('computed_by', ''))
    if remark := provenance.get(REMARK):
        diagnostics.raise_warning(fact.lower(), remark)
    else:
        diagnostics.clear_warning(fact.lower())
