"""Values of parameters as text, and back."""

import math

from active_recon.errors import ConfigError
from active_recon.parameters.value_text import text_from_value, value_from_text
import pytest


@pytest.mark.parametrize('value', [
    True, False, 0, -3, 0.5, 1e-7, -math.inf, 'attention', '', 'off', '1', 'null', 'a: b',
    'x' * 200, 'schön', [], [0.4, 1.0], [1, 2], ['drop_images:0.3', ''], [True]])
def test_a_value_comes_back_from_its_text(value):
    text = text_from_value(value)
    assert '\n' not in text
    for present in (None, value):
        back = value_from_text(text, present)
        assert (back, type(back)) == (value, type(value))


@pytest.mark.parametrize(('text', 'present', 'value'), [
    ('1', 0.5, 1.0), ('1e-3', 0.5, 0.001), ('off', 'auto', 'off'), ('', 'auto', ''),
    ('7', '3f2a', '7'), ('[1, 2]', [0.5], [1.0, 2.0]), ('[0.4, 1]', [], [0.4, 1.0]),
    ('true', 0.5, True), ('fast', 0.5, 'fast'), ('0.5', 3, 0.5), ('[1]', 'auto', [1]),
    ('2026-01-01', 3, '2026-01-01'), ('2026-13-01', 'auto', '2026-13-01')])
def test_a_text_becomes_what_the_present_value_is_as_far_as_it_allows(text, present, value):
    read = value_from_text(text, present)
    assert (read, type(read)) == (value, type(value))


def test_a_number_may_be_none():
    assert math.isnan(value_from_text('nan', 0.5))
    assert math.isnan(value_from_text(text_from_value(math.nan)))


@pytest.mark.parametrize('text', [
    '', 'null', '{a: 1}', '[[1]]', '[1, a]', '[null]', '[1', str(2**63)])
def test_what_no_parameter_can_hold_is_refused(text):
    with pytest.raises(ConfigError, match="no parameter's value: expected, in YAML"):
        value_from_text(text, 3)
