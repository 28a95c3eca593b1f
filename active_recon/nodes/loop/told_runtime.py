"""What runs a node's network, in its diagnostics."""

from collections.abc import Mapping

from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.runtimes import REMARK


def tell_of_runtime(diagnostics: Diagnostics, provenance: Mapping[str, str]) -> None:
    """Tell what runs the network, and warn with the reason where it is not what was preferred."""
    diagnostics.set_value('Runtime', provenance.get('computed_by', ''))
    if remark := provenance.get(REMARK):
        diagnostics.raise_warning('runtime', remark)
    else:
        diagnostics.clear_warning('runtime')
