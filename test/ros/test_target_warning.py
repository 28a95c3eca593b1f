"""A target that is never promised: the reason in words, whatever lies beside the weights."""

from active_recon.models.weights_files import SHIPPED
from active_recon.nodes.loop.target_warning import tell_target
from active_recon.parameters.view_planner import ViewPlannerParameters
from active_recon.policies import policy_in_use
import pytest

pytestmark = pytest.mark.ros


class Told:
    """Notes the warning that holds."""

    warning = ''

    def raise_warning(self, _kind, message):
        self.warning = message

    def clear_warning(self, _kind):
        self.warning = ''


def told(weights, target):
    diagnostics = Told()
    params = ViewPlannerParameters(weights=str(weights), target_quality=target)
    tell_target(diagnostics, params, policy_in_use('uniform', weights))
    return diagnostics.warning


@pytest.mark.parametrize(('content', 'said'), [
    (None, 'expected quality tables beside the weights, my-quality.json, found none'),
    ('{', 'my-quality.json: no readable quality tables')])
def test_tables_that_are_missing_or_damaged_are_why_a_target_is_never_reached(
        tmp_path, content, said):
    weights = tmp_path / 'my.safetensors'
    weights.symlink_to(SHIPPED)
    if content is not None:
        (tmp_path / 'my-quality.json').write_text(content)
    assert 'target_quality 0.5 is never reached: ' in told(weights, 0.5)
    assert said in told(weights, 0.5)
    assert not told(weights, 0.0)


def test_a_target_that_may_be_promised_is_no_reason_to_warn():
    assert not told(SHIPPED, 0.3)
    assert 'expected at most' in told(SHIPPED, 0.99)
