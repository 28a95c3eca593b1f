"""What nodes write stays under one folder, whatever it is called."""

from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.nodes.runtime.output import output_path
import pytest


@pytest.mark.parametrize('name', ['mesh.ply', '2026-11-21/run_0.mcap', 'a..b', './c'])
def test_a_relative_name_stays_under_the_folder(tmp_path, name):
    path = output_path(tmp_path / 'out', name)
    assert path == tmp_path / 'out' / name
    assert not path.exists()


def test_the_path_is_absolute_where_the_folder_is_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert output_path(Path('.'), 'mesh.ply') == tmp_path / 'mesh.ply'


def test_a_folder_that_is_a_link_is_as_good_as_any(tmp_path):
    (tmp_path / 'disk').mkdir()
    (tmp_path / 'out').symlink_to(tmp_path / 'disk')
    assert output_path(tmp_path / 'out', 'mesh.ply') == tmp_path / 'out' / 'mesh.ply'


@pytest.mark.parametrize('name', ['', '.', '/etc/passwd', '..', '../mesh.ply', 'a/../../mesh.ply',
                                  'a/../mesh.ply', 'elsewhere/mesh.ply', 'mesh\0.ply'])
def test_a_name_that_leads_elsewhere_is_refused(tmp_path, name):
    (tmp_path / 'out').mkdir()
    (tmp_path / 'out' / 'elsewhere').symlink_to(tmp_path)
    with pytest.raises(ConfigError, match='relative name that stays under') as refusal:
        output_path(tmp_path / 'out', name)
    assert refusal.value.kind == 'output'
