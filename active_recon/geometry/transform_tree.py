"""Frames that hang together by transforms over time, as ROS's tf has them."""

from bisect import bisect_right, insort
from collections.abc import Sequence
from dataclasses import dataclass, field

from active_recon.errors import ViewError
from active_recon.geometry.rotations import pose_between, pose_from_quaternion
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False, slots=True)
class Transform:
    """
    Where a child frame is in its parent frame, at a stamp in nanoseconds.

    - position: (3,), metres; quaternion: (4,), x, y, z, w, of any length above 0
    """

    stamp: int
    parent: str
    child: str
    position: Sequence[float]
    quaternion: Sequence[float]

    @property
    def pose(self) -> NDArray[np.float64]:
        """Parent from child, (4, 4)."""
        return pose_from_quaternion(self.position, self.quaternion)


@dataclass
class TransformTree:
    """
    Frames by the transforms that were added, in any order.

    A static transform holds at any time, whatever others there are of its child. Others are
    interpolated between the one before and the one after, none of them more than `max_gap` seconds
    away, and only if both have one parent.
    """

    max_gap: float
    _by_child: dict[str, list[Transform]] = field(default_factory=dict)
    _static: set[str] = field(default_factory=set)

    def add(self, transform: Transform, static: bool) -> None:
        """Add a transform; of static ones with the same child the last counts."""
        child = transform.child
        if static:
            self._static.add(child)
            self._by_child[child] = [transform]
        elif child not in self._static:
            insort(self._by_child.setdefault(child, []), transform, key=_stamp)

    @property
    def frames(self) -> list[str]:
        """The names of all frames, in alphabetical order."""
        firsts = [transforms[0] for transforms in self._by_child.values()]
        return sorted({name for each in firsts for name in (each.parent, each.child)})

    def pose(self, target: str, source: str, stamp: int) -> NDArray[np.float64]:
        """
        Return where the frame `source` is in the frame `target` at a stamp, (4, 4).

        Raises ViewError of kind `tf` where transforms do not connect them, of kind `no_pose` where
        one between them has no neighbours in time.
        """
        paths = [self._ancestors(frame, stamp) for frame in (source, target)]
        common = next((name for name in paths[0] if name in paths[1]), None)
        if common is None:
            raise ViewError(self._not_connected(target, source), 'tf')
        from_source, from_target = (self._in_ancestor(path[:path.index(common)], stamp)
                                    for path in paths)
        return np.linalg.inv(from_target) @ from_source

    def _in_ancestor(self, path: Sequence[str], stamp: int) -> NDArray[np.float64]:
        """Return where the first frame of a path is in the parent of its last, (4, 4)."""
        pose = np.eye(4)
        for name in path:
            pose = self._at(name, stamp) @ pose
        return pose

    def _ancestors(self, frame: str, stamp: int) -> list[str]:
        """Return a frame, its parent and so on; ends before a frame that came before."""
        path: list[str] = []
        while frame not in path:
            path.append(frame)
            if known := self._by_child.get(frame):
                frame = known[max(bisect_right(known, stamp, key=_stamp) - 1, 0)].parent
        return path

    def _at(self, child: str, stamp: int) -> NDArray[np.float64]:
        """Return where a frame is in its parent, (4, 4)."""
        moving = self._by_child[child]
        if child in self._static:
            return moving[0].pose
        after = bisect_right(moving, stamp, key=_stamp)
        before = moving[max(after - 1, 0)]
        if before.stamp == stamp:
            return before.pose
        beside = [each for each in moving[max(after - 1, 0):after + 1]
                  if abs(each.stamp - stamp) <= self.max_gap * 1e9]
        if after == 0 or len(beside) < 2 or beside[0].parent != beside[1].parent:
            raise ViewError(
                f'no transform of the frame {child!r} for the image of {stamp / 1e9:.3f} s: '
                'expected one of its stamp, or one before and one after it within '
                f'{self.max_gap:g} s (--max-pose-gap), got {self._beside(moving, after, stamp)}',
                'no_pose')
        return pose_between(beside[0].pose, beside[1].pose,
                            (stamp - beside[0].stamp) / (beside[1].stamp - beside[0].stamp))

    @staticmethod
    def _beside(moving: Sequence[Transform], after: int, stamp: int) -> str:
        around = [(moving[after - 1], 'before')] if after else []
        around += [(moving[after], 'after')] if after < len(moving) else []
        told = ' and '.join(f'one {abs(each.stamp - stamp) / 1e9:.3f} s {side}'
                            for each, side in around)
        parents = {each.parent for each, _ in around}
        return told if len(parents) == 1 else f'{told}, in the frames {sorted(parents)}'

    def _not_connected(self, target: str, source: str) -> str:
        known = self.frames
        unknown = ' and '.join(repr(name) for name in (target, source) if name not in known)
        return (f'no transforms between the frames {target!r} and {source!r}: expected both in '
                f'one tree, got {f"none with {unknown}" if unknown else "two trees"}; the frames '
                f'are {", ".join(known) or "none"}')


def _stamp(transform: Transform) -> int:
    return transform.stamp
