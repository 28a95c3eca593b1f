"""Surfaces are compared as others compare them, and thin parts are what an opening removes."""

import math

from active_recon.evaluation.surfaces import (
    ASKED,
    compare_surfaces,
    NO_SURFACE,
    recall,
    SampledSurface,
    surface_scores,
    thin_cells,
    voxel_surface,
)
import numpy as np
import point_cloud_utils
import pytest
import trimesh


@pytest.fixture(scope='module')
def ball():
    return trimesh.creation.icosphere(4, 0.4)


@pytest.fixture(scope='module')
def shifted(ball):
    moved = ball.copy()
    moved.apply_translation([0.015, 0, 0])
    return moved


def sampled(mesh, seed=0):
    return SampledSurface(mesh, seed=seed)


def test_a_surface_is_itself(ball):
    """Even where other points of it are drawn."""
    scores = compare_surfaces(sampled(ball), sampled(ball, seed=1))
    assert scores.f_score_1 > 0.99 and scores.f_score_2 == 1
    assert scores.chamfer < 0.005
    assert scores.normal_consistency > 0.99


def test_the_same_seed_draws_the_same_points(ball):
    np.testing.assert_array_equal(sampled(ball).points, sampled(ball).points)
    assert (sampled(ball).points != sampled(ball, seed=1).points).any()


def test_chamfer_and_f_scores_are_those_of_point_cloud_utils(ball, shifted):
    found, truth = SampledSurface(shifted, ASKED), SampledSurface(ball, ASKED)
    scores = compare_surfaces(found, truth)
    chamfer = point_cloud_utils.chamfer_distance(found.points, truth.points)
    assert scores.chamfer == pytest.approx(chamfer / 2, rel=1e-6)
    away, _ = point_cloud_utils.k_nearest_neighbors(found.points, truth.points, 1)
    missed, _ = point_cloud_utils.k_nearest_neighbors(truth.points, found.points, 1)
    for near, own in ((0.01, scores.f_score_1), (0.02, scores.f_score_2)):
        precision, completeness = (away < near).mean(), (missed < near).mean()
        assert own == pytest.approx(
            2 * precision * completeness / (precision + completeness), abs=1e-9)
    assert scores.f_score_1 < scores.f_score_2 < 1.0001


def test_few_points_say_what_all_would(ball, shifted):
    """Only some of a surface's points look for the nearest of the other's."""
    found, truth = sampled(shifted), sampled(ball)
    own = compare_surfaces(found, truth)
    away, missed = (asked.tree.query(asking.points)[0]
                    for asking, asked in ((found, truth), (truth, found)))
    assert own.chamfer == pytest.approx((away.mean() + missed.mean()) / 2, rel=0.02)
    assert own.f_score_1 == pytest.approx(
        2 / (1 / (away < 0.01).mean() + 1 / (missed < 0.01).mean()), abs=0.01)


def test_scores_are_the_same_both_ways(ball, shifted):
    there, back = (compare_surfaces(sampled(one), sampled(other))
                   for one, other in ((ball, shifted), (shifted, ball)))
    for name in vars(there):
        assert getattr(there, name) == pytest.approx(getattr(back, name))


def test_a_surface_inside_out_is_as_consistent(ball):
    flipped = ball.copy()
    flipped.invert()
    assert compare_surfaces(sampled(flipped), sampled(ball)).normal_consistency > 0.99


def test_normals_across_each_other_are_not_consistent():
    walls = trimesh.creation.box((0.001, 0.6, 0.6)), trimesh.creation.box((0.6, 0.001, 0.6))
    assert compare_surfaces(*map(sampled, walls)).normal_consistency < 0.1


def test_where_nothing_is_occupied_there_is_no_surface(ball):
    assert voxel_surface(np.zeros((8, 8, 8)), 0.5) is None
    assert surface_scores(None, sampled(ball)) == NO_SURFACE


def test_a_voxel_ball_is_near_the_ball(ball):
    at = (np.arange(64) + 0.5) / 64 - 0.5
    distance = np.sqrt(sum(np.square(axis) for axis in np.meshgrid(at, at, at)))
    found = voxel_surface(1 / (1 + np.exp(60 * (distance - 0.4))), 0.5)
    assert surface_scores(found, sampled(ball)).f_score_1 > 0.98


def test_thin_parts_are_legs_and_sheets_and_not_the_edges_of_a_block():
    truth = np.zeros((20, 20, 20), bool)
    truth[2:10, 2:10, 2:10] = True
    assert not thin_cells(truth).any()
    truth[5, 5, 10:18] = True  # a leg
    truth[12:18, 2:18, 3:5] = True  # a sheet
    thin = thin_cells(truth)
    assert thin[5, 5, 10:18].all() and thin[12:18, 2:18, 3:5].all()
    assert thin.sum() == 8 + 6 * 16 * 2


def test_recall_is_the_share_that_was_found():
    wanted = np.array([True, True, False, True])
    assert recall(np.array([True, False, True, True]), wanted) == pytest.approx(2 / 3)
    assert math.isnan(recall(wanted, np.zeros(4, bool)))
