"""The board that is printed, and its corners as they are found in images."""

import math

from active_recon.calibration.board import Board, detect_all
from active_recon.calibration.lens import project
from active_recon.errors import ConfigError, DataError
import numpy as np
from PIL import Image
import pytest
from rendered_boards import BOARD, fixed_camera, LENS, on_table, render, WIDE

POSE = np.linalg.inv(fixed_camera().pose) @ on_table(0.7)


@pytest.mark.parametrize('lens', [LENS, WIDE], ids=['straight', 'bent'])
def test_a_corner_is_found_where_the_lens_shows_it(lens):
    seen = BOARD.detect(render(lens, POSE), 'a.png')
    apart = seen.pixels - project(lens, seen.points, POSE)
    assert len(seen.points) >= 24
    assert np.quantile(np.linalg.norm(apart, axis=1), 0.9) < 0.5
    assert np.abs(np.median(apart, axis=0)).max() < 0.05  # nothing is shifted by half a pixel


def test_a_printed_board_has_its_true_size_and_is_found(tmp_path):
    board = Board(5, 4, 0.021, 0.016, '5x5_100')
    board.save(tmp_path / 'deep' / 'board.png')
    with Image.open(tmp_path / 'deep' / 'board.png') as printed:
        dots_per_m = np.array(printed.info['dpi']) / 0.0254
        sheet = np.asarray(printed)
    dark = np.argwhere(sheet < 128)
    printed_m = (dark.max(axis=0) - dark.min(axis=0) + 1)[::-1] / dots_per_m
    np.testing.assert_allclose(printed_m, [5 * 0.021, 4 * 0.021], atol=1e-4)
    np.testing.assert_allclose(board.printed_size(), [5 * 0.021, 4 * 0.021], atol=1e-9)
    assert len(board.detect(sheet, 'sheet').points) == 4 * 3


def test_a_side_that_falls_between_pixels_is_told_as_it_is_printed():
    width, height = Board(7, 5, 0.02503, 0.019).printed_size()
    assert width == pytest.approx(7 * 300 / 12e3)
    assert height == pytest.approx(5 * 300 / 12e3)


def test_another_board_is_told_from_ours():
    other = Board(9, 7, 0.03, 0.0225)
    with pytest.raises(DataError, match=r'a.png: another board: expected one of 5 x 4 .* give the '
                                        r'number'):
        Board(5, 4, 0.03, 0.0225).detect(render(LENS, POSE, board=other), 'a.png')


def test_where_the_board_is_not_seen_is_told_by_name():
    empty = np.full((LENS.height, LENS.width, 3), 120, np.uint8)
    board = render(LENS, POSE)
    found, missing = detect_all(BOARD, [('a', board), ('b', empty), ('c', board)], 2)
    assert [one.name for one in found] == ['a', 'c']
    assert missing == ['b']
    with pytest.raises(DataError, match=r'3 or more, .* in 2 of 3 \(not in b\)') as refusal:
        detect_all(BOARD, [('a', board), ('b', empty), ('c', board)], 3)
    assert refusal.value.kind == 'too_few_images'


def test_images_of_two_sizes_are_refused():
    board = render(LENS, POSE)
    with pytest.raises(DataError, match='images differ in size: .*of a.*of b'):
        detect_all(BOARD, [('a', board), ('b', board[:-2])], 2)


def test_a_strip_of_corners_is_not_enough_for_a_pose():
    drawn = np.pad(BOARD.drawn(2), 60, constant_values=255)
    assert BOARD.detect(drawn, 'whole') is not None
    assert BOARD.detect(drawn[:60 + 60 + 40], 'one row') is None


@pytest.mark.parametrize(('given', 'said'), [
    ({'columns': 2}, 'too few squares: expected 4 x 3 or more, got 2 x 5'),
    ({'columns': 3, 'rows': 3}, 'too few squares: expected 4 x 3 or more, got 3 x 3'),
    ({'square': 0.0}, 'markers smaller than the squares'),
    ({'marker': 0.03}, 'markers of 30 mm in squares of 30 mm'),
    ({'square': math.nan}, 'markers smaller than the squares'),
    ({'square': math.inf}, 'markers smaller than the squares'),
    ({'dictionary': '3x3'}, "unknown dictionary: expected one of 4x4_100.*got '3x3'"),
    ({'columns': 12, 'rows': 12}, 'too many markers: expected at most the 50 of 4x4_50, got 72'),
])
def test_a_board_that_cannot_be_is_refused(given, said):
    with pytest.raises(ConfigError, match=said):
        Board(**given)
