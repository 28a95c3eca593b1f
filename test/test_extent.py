"""How high an object is, from its hull and masks."""

from active_recon.geometry.cameras import Intrinsics, orbit_camera
from active_recon.photos.extent import explaining_box
from active_recon.photos.hull import depth_in_masks, hull
from active_recon.photos.views import PhotoView
from active_recon.volumes.object_box import object_box
import cv2
import numpy as np
import pytest

CELLS, LENS = 48, Intrinsics(700, 700, 320, 240, 640, 480)
CELL = 1 / CELLS
PLATE = [((-0.4, -0.4, 0.0), (0.4, 0.4, 0.06))]
LEGS = [((x, y, -0.3), (x + 0.02, y + 0.02, 0.3)) for x in (-0.3, 0.28) for y in (-0.3, 0.28)]
TABLE = [((-0.3, -0.3, 0.28), (0.3, 0.3, 0.3)), *LEGS]


def photographed(blocks, elevations):
    """Return views, with masks, of blocks in a circle about them, and their cameras."""
    cameras = [orbit_camera(0.3 + step * 2 * np.pi / len(elevations), elevation, 2.4, LENS)
               for step, elevation in enumerate(elevations)]
    views = []
    for camera in cameras:
        mask = np.zeros((LENS.height, LENS.width), np.uint8)
        for least, greatest in blocks:
            ends = np.array(np.meshgrid(*zip(least, greatest, strict=True))).reshape(3, -1).T
            outline = cv2.convexHull(np.round(camera.project(ends)[0]).astype(np.int32))
            cv2.fillConvexPoly(mask, outline, 1)
        views.append(PhotoView('', np.zeros((1, 1, 3), np.uint8), camera, mask > 0, 'masks'))
    return views, cameras


def measured(blocks, elevations, standing=False):
    """Return the box of a hull and that which explains its masks."""
    views, cameras = photographed(blocks, elevations)
    cells = hull(depth_in_masks(views, cameras, CELLS))
    return object_box(cells), explaining_box(
        cells, [view.mask for view in views], cameras, standing)


@pytest.mark.parametrize('blocks', [PLATE, TABLE, [((-0.1, -0.2, -0.4), (0.1, 0.2, 0.4))]],
                         ids=['plate', 'table', 'tall'])
@pytest.mark.parametrize('elevations', [[0.6] * 6, [0.2, 0.8] * 3, [-0.3, 0.5] * 3])
def test_a_thing_with_edges_is_as_high_as_its_masks_need_it(blocks, elevations):
    _, box = measured(blocks, elevations)
    lowest, highest = (min(least[2] for least, _ in blocks),
                       max(greatest[2] for _, greatest in blocks))
    np.testing.assert_allclose(box[:, 2], [lowest, highest], atol=2.1 * CELL)


def test_from_above_a_hull_reaches_below_and_above_a_plate_and_its_middle_is_not_the_plate_s():
    whole, box = measured(PLATE, [0.6] * 6)
    assert whole[0, 2] < -0.2 and whole[1, 2] > 0.2
    assert abs(box[:, 2].mean() - 0.03) < CELL
    np.testing.assert_array_equal(whole[:, :2], box[:, :2])


def test_what_stands_on_a_ground_reaches_down_to_it():
    views, cameras = photographed(PLATE, [0.6] * 6)
    cells = hull(depth_in_masks(views, cameras, CELLS))
    cells[..., :CELLS // 2 - 4] = False
    box = explaining_box(cells, [view.mask for view in views], cameras, standing=True)
    assert box[0, 2] == pytest.approx(-4 * CELL) and box[1, 2] < 0.06 + 1.5 * CELL


def test_masks_that_no_cell_explains_cut_nothing():
    views, cameras = photographed(PLATE, [0.6] * 6)
    cells = np.zeros((CELLS,) * 3, bool)
    cells[2:5, 3:9, 40:46] = True
    aside = [np.zeros_like(view.mask) for view in views]
    np.testing.assert_array_equal(explaining_box(cells, aside, cameras, False), object_box(cells))


def test_without_cells_there_is_no_box():
    views, cameras = photographed(PLATE, [0.6] * 6)
    assert explaining_box(np.zeros((CELLS,) * 3, bool), [view.mask for view in views], cameras,
                          False) is None
