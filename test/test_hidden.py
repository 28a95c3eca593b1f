"""Cells that no camera outside of a shape can tell."""

import math

from active_recon.volumes.hidden import hidden_cells, LOWEST, sight_lines
import numpy as np
import pytest
from scipy.ndimage import binary_fill_holes

_SIDE = 32


def a_box(open_side=None):
    """Return a box of walls two cells thick, without the wall at an end of an axis."""
    cells = np.zeros((_SIDE,) * 3, bool)
    cells[6:26, 6:26, 6:26] = True
    inside = [slice(8, 24)] * 3
    if open_side is not None:
        axis, end = open_side
        inside[axis] = slice(8, None) if end > 0 else slice(None, 24)
    cells[tuple(inside)] = False
    return cells


def test_nothing_is_hidden_of_a_solid_shape_or_of_none():
    solid = np.zeros((_SIDE,) * 3, bool)
    assert not hidden_cells(solid).any()
    solid[4:20, 10:30, 3:9] = True
    assert not hidden_cells(solid).any()


def test_the_inside_of_a_closed_box_is_hidden_whole():
    box = a_box()
    np.testing.assert_array_equal(box | hidden_cells(box), binary_fill_holes(box))


def test_the_inside_is_hidden_where_the_only_opening_is_below():
    hidden = hidden_cells(a_box((2, -1)))
    seen_from_below = 16 * math.tan(-LOWEST)  # the opening's width, along the lowest line
    assert hidden[8:24, 8:24, 6 + math.ceil(seen_from_below):24].all()
    assert not hidden[:, :, :6].any()


@pytest.mark.parametrize('open_side', [(2, 1), (0, 1), (0, -1), (1, 1), (1, -1)])
def test_cameras_see_into_what_is_open_above_or_at_a_side(open_side):
    hidden = hidden_cells(a_box(open_side))
    assert hidden.sum() < 0.02 * 16 ** 3


def test_a_shell_hides_as_much_whichever_way_it_is_turned():
    offsets = np.indices((_SIDE,) * 3) - (_SIDE - 1) / 2
    away = np.sqrt((offsets ** 2).sum(axis=0))
    ball = (away < 13) & (away > 10)
    ball[:, :, :6] = False  # a hole below
    ball[20:, 15:18, 8] = False
    counts = [hidden_cells(np.rot90(ball, turns)).sum() for turns in range(4)]
    assert min(counts) > 0.9 * (away <= 10)[:, :, 6:].sum()
    assert max(counts) - min(counts) < 0.01 * max(counts)


def test_hidden_cells_are_empty_and_hold_what_is_enclosed():
    rng = np.random.default_rng(0)
    for density in (0.2, 0.5, 0.8):
        cells = rng.random((16, 16, 16)) < density
        hidden = hidden_cells(cells)
        assert not (hidden & cells).any()
        enclosed = binary_fill_holes(cells) & ~cells
        assert (enclosed & hidden).sum() == enclosed.sum()


def test_sight_lines_are_even_over_what_cameras_can_reach():
    lines = sight_lines(2000)
    np.testing.assert_allclose(np.linalg.norm(lines, axis=1), 1)
    assert lines[:, 2].min() == pytest.approx(math.sin(LOWEST), abs=1e-3)
    # By Archimedes, heights are spread evenly where directions are
    np.testing.assert_allclose(np.histogram(lines[:, 2], 10, (math.sin(LOWEST), 1))[0], 200)
    assert np.abs(lines[:, :2].mean(axis=0)).max() < 0.01
