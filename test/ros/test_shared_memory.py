"""A node's room in shared memory: enough for its largest message, or what its user has chosen."""

from pathlib import Path
import re

from active_recon.nodes.runtime.shared_memory import PROFILE
import numpy as np
import pytest

pytestmark = pytest.mark.ros
CLOUD_BYTES = 64**3 * 4 * np.dtype(np.float32).itemsize
"""Of all cells of the finest grid that a network gives."""


@pytest.fixture
def room(start_node):
    """Return what starts a recorder, and returns the bytes of its own room for DDS."""
    def started():
        others = {str(path) for path in Path('/dev/shm').iterdir()}  # which it may look into
        maps = Path(f'/proc/{start_node("recorder").pid}/maps').read_text()
        found = re.findall(r'^(\w+)-(\w+) .* (\S*/fast(?:rtps|dds)_\S*)', maps, re.MULTILINE)
        return max((int(end, 16) - int(begin, 16) for begin, end, file in found
                    if file not in others), default=0)
    return started


@pytest.mark.parametrize('chosen', [False, True])
def test_a_node_has_room_for_whole_clouds_unless_its_user_has_chosen(
        room, monkeypatch, tmp_path, chosen):
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE')
    if chosen:
        path = tmp_path / 'profiles.xml'
        path.write_text(PROFILE.read_text().replace('16777216', '1048576'))
        monkeypatch.setenv('FASTDDS_DEFAULT_PROFILES_FILE', str(path))
    has_room = room() >= 2 * CLOUD_BYTES  # both clouds of a view
    assert has_room is not chosen


def test_a_profile_in_the_folder_where_a_node_starts_is_the_users_choice(
        room, monkeypatch, tmp_path):
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE')
    (tmp_path / '0').mkdir()
    (tmp_path / '0' / 'DEFAULT_FASTRTPS_PROFILES.xml').write_text(
        PROFILE.read_text().replace('16777216', '1048576'))
    assert 0 < room() < CLOUD_BYTES
