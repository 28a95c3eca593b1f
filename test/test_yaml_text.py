"""YAML text: a value as ROS reads it, or one error in one line, and so for all that read files."""

from active_recon.bags.storage.metadata import qos_from_yaml, yaml_mapping
from active_recon.calibration.lens import read_lens
from active_recon.errors import ConfigError, DataError
from active_recon.parameters.value_text import value_from_text
from active_recon.parameters.yaml_files import read_yaml
from active_recon.yaml_text import yaml_value
import pytest

WRONG = {
    'a: [1': "expected ',' or ']'",
    'a: &x [1]\nb: *x': 'aliases are not allowed',
    '[' * 200_000: 'nested too deep: expected at most 100 levels',
    '{a: ' * 200_000: 'nested too deep',
    '- ' * 200_000: 'nested too deep',
    '? ' * 200_000: 'nested too deep',
    '!!int ""': 'does not fit its tag',
    '!!float ""': 'does not fit its tag',
    '!!bool x': 'does not fit its tag',
    '!!timestamp x': 'does not fit its tag',
    '!!python/object:os.system x': 'could not determine a constructor',
    '1: 2\n---\n3': 'expected a single document',
    '\x00': 'unacceptable character',
    '9' * 5000: 'Exceeds the limit',
}


@pytest.mark.parametrize(('text', 'why'), WRONG.items(), ids=[text[:12] for text in WRONG])
def test_whatever_is_wrong_is_one_error_in_one_line_to_all_that_read_yaml(tmp_path, text, why):
    with pytest.raises(ValueError, match=why) as caught:
        yaml_value(text)
    assert '\n' not in str(caught.value)
    path = tmp_path / 'any.yaml'
    path.write_text(text)
    for read, kind in ((lambda: yaml_mapping(text.encode(), 'a bag'), DataError),
                       (lambda: read_yaml(path), ConfigError),
                       (lambda: value_from_text(text), ConfigError),
                       (lambda: read_lens(path), DataError)):
        with pytest.raises(kind, match=why) as caught:
            read()
        assert '\n' not in str(caught.value).replace(text, '')
    assert qos_from_yaml(text) == ()


def test_a_date_is_text_as_to_ros():
    assert yaml_value('2026-01-01: 2026-02-02') == {'2026-01-01': '2026-02-02'}
    assert value_from_text('2026-01-01') == '2026-01-01'


def test_a_lens_of_endless_images_is_refused(tmp_path):
    path = tmp_path / 'lens.yaml'
    path.write_text('{camera_matrix: {data: [1, 0, 1, 0, 1, 1, 0, 0, 1]}, image_width: .inf, '
                    'distortion_coefficients: {data: [0, 0, 0, 0, 0]}, image_height: 4, '
                    'distortion_model: plumb_bob}')
    with pytest.raises(DataError, match='no calibration'):
        read_lens(path)
