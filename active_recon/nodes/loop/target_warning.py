"""Warns of a target quality, and of a least gain, that end no episode."""

from active_recon.errors import WeightsError
from active_recon.models.weights_files import find_weights
from active_recon.nodes.runtime.diagnostics import Diagnostics
from active_recon.nodes.runtime.run import one_line
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.policies import POLICIES, PolicyInUse
from active_recon.quality.tables import QualityTables, tables_path

_WARNING = 'target_quality'
_GAIN_WARNING = 'min_gain'


def tell_target(diagnostics: Diagnostics, params: ViewPlannerParameters,
                in_use: PolicyInUse) -> None:
    """Warn while no episode can end as having reached the target."""
    target = params.target_quality
    problem = _problem(params, in_use) if target else ''
    if problem:
        diagnostics.raise_warning(_WARNING, (
            f'target_quality {target:g} is never reached: {problem}; an episode ends for other '
            'reasons'))
    else:
        diagnostics.clear_warning(_WARNING)


def tell_min_gain(diagnostics: Diagnostics, min_gain: float, policy: str,
                  lacks_gains: bool) -> None:
    """Warn while the scores of the policy are not what the least gain is compared with."""
    if min_gain and lacks_gains:
        diagnostics.raise_warning(_GAIN_WARNING, (
            f'min_gain {min_gain:g} has no effect: expected a policy whose scores are expected '
            f'gains, as those of attention with lifting weights, got {policy}; an episode ends '
            'for other reasons'))
    else:
        diagnostics.clear_warning(_GAIN_WARNING)


def _problem(params: ViewPlannerParameters, in_use: PolicyInUse) -> str:
    """Return why the target is never promised, '' where it may be."""
    path = tables_path(find_weights(params.weights or None))
    if not path.is_file():
        return f'expected quality tables beside the weights, {path.name}, found none'
    around = not (params.elevation_range or params.reachable_views)
    try:
        most = QualityTables.read(path).most_promised(
            around and POLICIES[in_use.name].is_learned)
    except WeightsError as error:
        return one_line(error)
    if params.target_quality <= most:
        return ''
    return (f'expected at most {most:g}, all that the tables of the weights promise with the '
            f'policy {in_use.name}')
