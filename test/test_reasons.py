"""The reason for a goal names the part that no view has seen."""

import math

from active_recon.geometry.cameras import orbit_camera
from active_recon.policies import Observation
from active_recon.policies.reasons import goal_reason
import numpy as np
import pytest

SIDE = 32


def block_in_doubt():
    """Return an opaque block whose faces are all doubtful."""
    cells = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
    cells[0, 8:24, 8:24, 8:24] = 0.5
    cells[0, 10:22, 10:22, 10:22] = 1
    return cells


def pose(azimuth_deg, elevation_deg=0):
    return orbit_camera(math.radians(azimuth_deg), math.radians(elevation_deg)).pose


def reason(goal, *taken, gain=None):
    return goal_reason(Observation(np.zeros((1, 1, 4, 4), np.float32), np.array([taken]),
                                   np.array([[goal]]), block_in_doubt()), goal, gain)


@pytest.mark.parametrize('azimuth_deg', [0, 90, 180, 270])
def test_a_side_that_no_view_has_seen_is_named_by_its_azimuth(azimuth_deg):
    told = reason(pose(azimuth_deg), pose(azimuth_deg + 180)).shows
    found = float(told.split('azimuth ')[1].split(' degrees')[0])
    assert abs((found - azimuth_deg + 180) % 360 - 180) < 15
    assert told.startswith('shows the side')


def test_a_side_just_below_a_whole_turn_is_towards_azimuth_0():
    cells = block_in_doubt()
    cells[0, :, 8:16] -= (cells[0, :, 8:16] == 0.5) * np.float32(0.007)  # a little less at -y
    seen = Observation(np.zeros((1, 1, 4, 4), np.float32), np.array([[pose(180)]]),
                       np.array([[pose(0)]]), cells)
    assert 'the side towards azimuth 0 degrees' in goal_reason(seen, pose(0), None).shows


@pytest.mark.parametrize(('elevation_deg', 'part'), [(80, 'the top'), (-80, 'the underside')])
def test_top_and_underside_are_named(elevation_deg, part):
    told = reason(pose(0, elevation_deg), pose(0, -elevation_deg)).shows
    assert told.startswith(f'shows {part}: ')


def test_a_side_that_was_seen_is_looked_at_again():
    assert reason(pose(0), pose(0)).shows.startswith('looks again at the side towards azimuth')


def test_the_expected_gain_is_told_where_it_is_known():
    told = reason(pose(0), pose(180), gain=0.0421)
    assert told.sentence == f'{told.shows}; expected gain of IoU 0.042'
    assert told.gain == 0.0421
    unknown = reason(pose(0), pose(180))
    assert (unknown.gain, unknown.sentence) == (None, told.shows)


def test_an_empty_volume_has_a_reason_too():
    seen = Observation(np.zeros((1, 1, 4, 4), np.float32), np.array([[pose(0)]]),
                       np.array([[pose(90)]]), np.zeros((1, SIDE, SIDE, SIDE), np.float32))
    assert goal_reason(seen, pose(90)).shows == (
        'looks again at the whole object, where doubt is left')
