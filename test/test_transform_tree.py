"""Frames connected by transforms: compositions, interpolation in time, what is not connected."""

from itertools import permutations

from active_recon.errors import ViewError
from active_recon.geometry.rotations import quaternion_from_matrix
from active_recon.geometry.transform_tree import Transform, TransformTree
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

SECOND = 1_000_000_000


def random_pose(rng):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(rng=rng).as_matrix()
    pose[:3, 3] = rng.normal(size=3)
    return pose


def transform(pose, parent, child, stamp=0):
    return Transform(stamp, parent, child, pose[:3, 3].tolist(),
                     quaternion_from_matrix(pose[:3, :3]))


@pytest.fixture
def chain():
    """Return a tree world - base - tool - camera and base - object, and its poses by child."""
    rng = np.random.default_rng(0)
    poses = {child: random_pose(rng) for child in ('base', 'tool', 'camera', 'object')}
    parents = {'base': 'world', 'tool': 'base', 'camera': 'tool', 'object': 'base'}
    tree = TransformTree(0.1)
    for child, pose in poses.items():
        tree.add(transform(pose, parents[child], child), static=True)
    return tree, poses


def test_a_pose_is_the_product_along_the_way_between_two_frames(chain):
    tree, poses = chain
    found = tree.pose('object', 'camera', 5)
    expected = np.linalg.inv(poses['object']) @ poses['tool'] @ poses['camera']
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_any_two_ways_end_at_the_same_place(chain):
    tree, _ = chain
    for one, two, three in permutations(tree.frames, 3):
        np.testing.assert_allclose(tree.pose(one, two, 0) @ tree.pose(two, three, 0),
                                   tree.pose(one, three, 0), atol=1e-9)
    for name in tree.frames:
        np.testing.assert_allclose(tree.pose(name, name, 0), np.eye(4), atol=1e-12)


@pytest.mark.parametrize('fraction', [0, 0.25, 0.9, 1])
def test_between_two_stamps_it_is_interpolated_as_scipy_does(fraction):
    rng = np.random.default_rng(1)
    first, last = random_pose(rng), random_pose(rng)
    tree = TransformTree(1.0)
    for stamp, pose in ((2 * SECOND, last), (SECOND, first)):  # in any order
        tree.add(transform(pose, 'object', 'camera', stamp), static=False)
    found = tree.pose('object', 'camera', round((1 + fraction) * SECOND))
    turns = Slerp([0, 1], Rotation.from_matrix([first[:3, :3], last[:3, :3]]))
    np.testing.assert_allclose(found[:3, :3], turns(fraction).as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found[:3, 3], (1 - fraction) * first[:3, 3]
                               + fraction * last[:3, 3], atol=1e-9)


@pytest.mark.parametrize('stamp', [0, SECOND, 4 * SECOND])
def test_before_the_first_after_the_last_and_far_from_either_there_is_none(stamp):
    tree = TransformTree(0.4)
    for each in (SECOND // 2, 2 * SECOND, 3 * SECOND):
        tree.add(transform(np.eye(4), 'object', 'camera', each), static=False)
    with pytest.raises(ViewError, match="'camera' .* within 0.4 s .*, got one ") as raised:
        tree.pose('object', 'camera', stamp)
    assert raised.value.kind == 'no_pose'


def test_a_static_transform_holds_whatever_moving_ones_there_are_of_its_child(chain):
    tree, poses = chain
    tree.add(transform(np.eye(4), 'tool', 'camera', SECOND), static=False)
    for stamp in (0, SECOND, 9 * SECOND):
        np.testing.assert_allclose(tree.pose('tool', 'camera', stamp), poses['camera'])


def test_what_moves_above_both_frames_need_not_be_known(chain):
    tree, poses = chain
    tree.add(transform(np.eye(4), 'map', 'world', 9 * SECOND), static=False)
    np.testing.assert_allclose(tree.pose('base', 'tool', 0), poses['tool'], atol=1e-12)


def test_a_frame_that_gets_another_parent_is_not_interpolated_across_that():
    tree = TransformTree(10)
    for stamp, parent in ((0, 'left'), (1, 'left'), (2, 'right'), (3, 'right')):
        tree.add(transform(np.eye(4), parent, 'cup', stamp * SECOND), static=False)
    tree.add(transform(np.eye(4), 'robot', 'left'), static=True)
    tree.add(transform(np.eye(4), 'robot', 'right'), static=True)
    for inside in (SECOND // 2, 2 * SECOND + 5):
        np.testing.assert_allclose(tree.pose('robot', 'cup', inside), np.eye(4))
    with pytest.raises(ViewError, match="'cup' .* in the frames \\['left', 'right'\\]"):
        tree.pose('robot', 'cup', SECOND + 5)


def test_frames_of_two_trees_and_unknown_ones_are_refused_by_their_names(chain):
    tree, _ = chain
    tree.add(transform(np.eye(4), 'floor', 'table'), static=True)
    with pytest.raises(ViewError, match="'table' and 'camera': .* got two trees; the frames are "
                                        'base, camera, floor, object, table, tool, world'):
        tree.pose('table', 'camera', 0)
    with pytest.raises(ViewError, match="got none with 'cup'; the frames"):
        tree.pose('cup', 'camera', 0)
    with pytest.raises(ViewError, match="none with 'a' and 'b'; the frames are none"):
        TransformTree(0.1).pose('a', 'b', 0)


def test_frames_in_a_circle_end(chain):
    tree, _ = chain
    tree.add(transform(np.eye(4), 'camera', 'base'), static=True)
    with pytest.raises(ViewError, match='no transforms between'):
        tree.pose('world', 'camera', 0)
