"""A node's room in shared memory: enough for its largest message, or what its user has chosen."""

from pathlib import Path
import re

from active_recon.nodes.runtime.shared_memory import PROFILE
import numpy as np
import pytest

pytestmark = pytest.mark.ros
CLOUD_BYTES = 64**3 * 4 * np.dtype(np.float32).itemsize
"""Of all cells of the finest grid that a network gives."""


def room(pid):
    """Return the bytes of the largest segment in shared memory that a process has for DDS."""
    ends = re.findall(r'^(\w+)-(\w+) .*/fast(?:rtps|dds)_', Path(f'/proc/{pid}/maps').read_text(),
                      re.MULTILINE)
    return max((int(end, 16) - int(begin, 16) for begin, end in ends), default=0)


@pytest.mark.parametrize('chosen', [False, True])
def test_a_node_has_room_for_whole_clouds_unless_its_user_has_chosen(
        start_node, monkeypatch, tmp_path, chosen):
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE')
    if chosen:
        path = tmp_path / 'profiles.xml'
        path.write_text(PROFILE.read_text().replace('16777216', '1048576'))
        monkeypatch.setenv('FASTDDS_DEFAULT_PROFILES_FILE', str(path))
    has_room = room(start_node('recorder').pid) >= 2 * CLOUD_BYTES  # both clouds of a view
    assert has_room is not chosen


def test_a_profile_in_the_folder_where_a_node_starts_is_the_users_choice(
        start_node, monkeypatch, tmp_path):
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE')
    (tmp_path / '0').mkdir()
    (tmp_path / '0' / 'DEFAULT_FASTRTPS_PROFILES.xml').write_text(
        PROFILE.read_text().replace('16777216', '1048576'))
    assert 0 < room(start_node('recorder').pid) < CLOUD_BYTES
