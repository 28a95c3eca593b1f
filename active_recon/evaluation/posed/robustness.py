"""Robustness tests: the IoU with disturbed views, compared with that of clean views."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
import math
from typing import NamedTuple

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.posed.entrants import Entrant
from active_recon.evaluation.posed.measuring import orders_of, Plan, targets_of
from active_recon.evaluation.posed.scene import Scene
from active_recon.evaluation.posed.scoring import iou_scores, pooled, Scores, Target
from active_recon.evaluation.posed.walking import some_objects, walk
from active_recon.evaluation.rollouts import batches, Observer
from active_recon.evaluation.subsets import drawn_over_categories
from active_recon.geometry.cameras import TURN
from active_recon.geometry.view_distance import pose_directions
from active_recon.models.lifted import projected, projection
from active_recon.models.network import Cameras
from active_recon.volumes.voxels import turned
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import expit
import torch

YAWS = 24
POSE_ERROR = math.radians(2)
CUT_SHARE = 1 / 3
BANDS_DEG = ((0, 15), (15, 30), (30, 45), (45, 60), (60, 75))
_BATCH = 4


class Found(NamedTuple):
    """Scores of one object (its index `row`) with one disturbance, and without it."""

    name: str
    row: int
    disturbed: Scores
    clean: Scores


@dataclass(frozen=True, eq=False)
class Block:
    """A batch of B objects: their views, their truths, and the views used, (B, c)."""

    views: ViewSet
    targets: Sequence[Target]
    order: NDArray[np.int64]


def disturbances(scene: Scene, entrant: Entrant, plan: Plan, count: int, most: int,
                 advance: Callable[[int], None] = lambda done: None) -> Iterator[Found]:
    """
    Yield an entrant's IoU after `count` random views of up to `most` objects, with disturbances.

    - `yaw NNN`: the object frame rotated by that many degrees, with the same images. The
      reconstruction is rotated back, since interpolating the truth's cells would lose four times
      as much as interpolating probabilities. Cells rotated out of the cube are not counted
    - `poses off by 2 degrees`: each rotated about the object's centre, about a random axis
    - `a third of the cube cut`: missing at one side of the first view's image
    - `elevation A to B`: one or three views in that band, compared with as many of any elevation

    Yields nothing where the network cannot use the views.
    """
    shown = scene.shown_to(entrant.network)
    if shown is None:
        return
    orders = orders_of(scene, replace(plan, counts=(min(count, scene.view_count),)))['random'][0]
    some = torch.from_numpy(drawn_over_categories(scene.views.categories, most, plan.seed))
    for part in batches(len(some), _BATCH):
        rows = some[part]
        block = Block(some_objects(shown, rows), targets_of(scene, rows, surface=False),
                      orders[rows.numpy()])
        own = replace(plan, seed=plan.seed + int(part[0]))  # else all blocks were drawn alike
        for kind in (_turned, _off, _cut, _bands):
            for found in kind(block, entrant, own):
                yield found._replace(row=int(rows[found.row]))
        advance(len(rows))


def _turned(block: Block, entrant: Entrant, plan: Plan) -> Iterator[Found]:
    observer = Observer(entrant.network, block.views, plan.bfloat16)
    clean: list[Scores] = []
    for step in range(YAWS):
        scores = list(_iou(block, entrant, observer, block.order, step * TURN / YAWS))
        clean = clean or scores
        for row, (own, of_clean) in enumerate(zip(scores, clean, strict=True)):
            yield Found(f'yaw {round(step * 360 / YAWS):03d}', row, own, of_clean)


def _off(block: Block, entrant: Entrant, plan: Plan) -> Iterator[Found]:
    views = replace(block.views, poses=poses_off(block.views, POSE_ERROR, plan.seed))
    yield from _beside_clean('poses off by 2 degrees', block, views, entrant, plan)


def _cut(block: Block, entrant: Entrant, plan: Plan) -> Iterator[Found]:
    views = cut_views(block.views, block.order[:, 0], CUT_SHARE, plan.seed)
    yield from _beside_clean('a third of the cube cut', block, views, entrant, plan)


def _bands(block: Block, entrant: Entrant, plan: Plan) -> Iterator[Found]:
    """Compare views from one band of elevations with views from any."""
    elevations = np.degrees(np.arcsin(pose_directions(block.views.poses.numpy())[..., 2]))
    if np.ptp(elevations) < BANDS_DEG[0][1]:
        return  # all views are in the same band
    observer = Observer(entrant.network, block.views, plan.bfloat16)
    rng = np.random.default_rng(plan.seed)
    count = elevations.shape[1]
    any_order = rng.permuted(np.tile(np.arange(count), (len(elevations), 1)), axis=1)
    for views in (1, 3):
        if views > count:
            continue
        clean = list(_iou(block, entrant, observer, any_order[:, :views]))
        for low, high in BANDS_DEG:
            within = (elevations >= low) & (elevations < high)
            own = [order[within[row][order]][:views] for row, order in enumerate(any_order)]
            rows = [row for row, order in enumerate(own) if len(order) == views]
            if not rows:
                continue
            # Other objects get any views, so that the batch keeps its size
            order = np.stack([mine if len(mine) == views else any_order[row, :views]
                              for row, mine in enumerate(own)])
            scores = list(_iou(block, entrant, observer, order))
            for row in rows:
                yield Found(f'elevation {low} to {high}, {views} view{"s" * (views > 1)}', row,
                            scores[row], clean[row])


def poses_off(views: ViewSet, angle: float, seed: int = 0) -> torch.Tensor:
    """Return poses (N, V, 4, 4), each rotated about the object's centre by an angle, radians."""
    shape = views.poses.shape[:2]
    axes = np.random.default_rng([seed, 1]).normal(size=(*shape, 3))
    axes *= angle / np.linalg.norm(axes, axis=-1, keepdims=True)
    turns = np.tile(np.eye(4), (*shape, 1, 1))
    turns[..., :3, :3] = Rotation.from_rotvec(axes.reshape(-1, 3)).as_matrix().reshape(
        *shape, 3, 3)
    return torch.from_numpy(turns) @ views.poses


def cut_views(views: ViewSet, chosen: NDArray[np.int64], share: float, seed: int = 0) -> ViewSet:
    """
    Return a set in which the view `chosen` (N,) of each object lacks a share of the cube.

    The image is cut at one of its four sides, drawn by the seed, so that this share of the cube's
    cells projects outside of it.
    """
    images = views.images.clone()
    seen = torch.ones(images.shape[:4], dtype=torch.bool) if views.seen is None else (
        views.seen.clone())
    rng, size = np.random.default_rng([seed, 2]), views.image_size
    across = torch.arange(size) + 0.5
    for row, view in enumerate(chosen.tolist()):
        one = Cameras(views.poses[row, view][None], views.intrinsics[row, view][None])
        where, _ = projected(projection(one, size), 16)
        axis, sign = int(rng.integers(2)), 1 - 2 * int(rng.integers(2))
        end = sign * float(torch.quantile(sign * where[0, :, axis], 1 - share))
        kept = sign * (across / size * 2 - 1) <= sign * end
        keep = kept[None, :].expand(size, size) if axis == 0 else kept[:, None].expand(size, size)
        seen[row, view] &= keep
        images[row, view] *= keep[..., None]
    return replace(views, images=images, seen=seen)


def turned_back(occupancy: NDArray[np.float32], yaw: float) -> NDArray[np.float32]:
    """
    Return occupancies (R, R, R) of a frame that was rotated by a yaw, in the original frame.

    Cells are interpolated linearly, except at quarter turns. Cells outside of the rotated cube are
    NaN.
    """
    quarters = yaw / (TURN / 4)
    if abs(quarters - round(quarters)) < 1e-9:
        return np.rot90(occupancy, -round(quarters))
    across = (np.arange(len(occupancy)) + 0.5) / len(occupancy) - 0.5
    x, y = across[:, None], across
    cosine, sine = math.cos(yaw), math.sin(yaw)
    held = (np.abs(cosine * x - sine * y) <= 0.5) & (np.abs(sine * x + cosine * y) <= 0.5)
    return np.where(held[..., None], turned(occupancy, -yaw), np.float32(np.nan))


def _beside_clean(name: str, block: Block, views: ViewSet, entrant: Entrant,
                  plan: Plan) -> Iterator[Found]:
    disturbed, clean = (
        _iou(block, entrant, Observer(entrant.network, shown, plan.bfloat16), block.order)
        for shown in (views, block.views))
    for row, (own, of_clean) in enumerate(zip(disturbed, clean, strict=True)):
        yield Found(name, row, own, of_clean)


def _iou(block: Block, entrant: Entrant, observer: Observer, order: NDArray[np.int64],
         yaw: float = 0.0) -> Iterator[Scores]:
    """Yield the IoU of each object after the views of its order (B, c), with a rotated frame."""
    objects = torch.arange(len(order))
    yaws = torch.full((len(order),), yaw) if yaw else None
    logits = next(walk(observer, objects, [order], yaws)).cpu().numpy()
    for one, truth in zip(logits, block.targets, strict=True):
        occupancy = turned_back(expit(one), yaw)
        # The maximum with NaN is NaN, so a coarse cell that is partly unknown is unknown
        unknown = {side: np.isnan(pooled(occupancy, side)) for side in entrant.sides}
        known = {side: cells & ~unknown.get(side, np.False_)
                 for side, cells in truth.cells.items()}
        yield iou_scores(occupancy, {'iou': known}, entrant.sides, entrant.thresholds)
