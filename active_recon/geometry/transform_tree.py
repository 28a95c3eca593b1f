"""Frames that hang together by transforms over time, as ROS's tf has them."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from active_recon.errors import ViewError
from active_recon.geometry.rotations import matrix_from_quaternion, pose_between
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
        pose = np.eye(4)
        pose[:3, :3] = matrix_from_quaternion(self.quaternion)
        pose[:3, 3] = self.position
        return pose


@dataclass
class TransformTree:
    """
    Frames by the transforms that were added, in any order.

    A static transform holds at any time, whatever others there are of its child. Others are
    interpolated between the one before and the one after, none of them more than `max_gap` seconds
    away, and only if both have one parent.
    """

    max_gap: float
    _static: dict[str, Transform] = field(default_factory=dict)
    _moving: dict[str, list[Transform]] = field(default_factory=dict)
    _is_sorted: bool = True

    def add(self, transform: Transform, static: bool) -> None:
        """Add a transform; of static ones with the same child the last counts."""
        if static:
            self._static[transform.child] = transform
        else:
            self._moving.setdefault(transform.child, []).append(transform)
            self._is_sorted = False

    @property
    def frames(self) -> list[str]:
        """The names of all frames, in alphabetical order."""
        every = [*self._static.values(), *(each[0] for each in self._moving.values())]
        return sorted({name for each in every for name in (each.parent, each.child)})

    def pose(self, target: str, source: str, stamp: int) -> NDArray[np.float64]:
        """
        Return where the frame `source` is in the frame `target` at a stamp, (4, 4).

        Raises ViewError of kind `tf` where transforms do not connect them, of kind `no_pose` where
        one between them has no neighbours in time.
        """
        self._sort()
        down, up = ({name: number for number, name in enumerate(self._ancestors(frame, stamp))}
                    for frame in (source, target))
        common = next((name for name in down if name in up), None)
        if common is None:
            raise ViewError(self._not_connected(target, source), 'tf')
        from_source, from_target = (self._in_ancestor(path, common, stamp) for path in (down, up))
        return np.linalg.inv(from_target) @ from_source

    def _in_ancestor(self, path: Mapping[str, int], common: str,
                     stamp: int) -> NDArray[np.float64]:
        """Return where the first frame of a path upwards is in one that it passes, (4, 4)."""
        pose = np.eye(4)
        for name in list(path)[:path[common]]:
            pose = self._at(name, stamp) @ pose
        return pose

    def _ancestors(self, frame: str, stamp: int) -> Iterator[str]:
        """Yield a frame, its parent and so on; ends before a frame that came before."""
        seen: set[str] = set()
        while frame not in seen:
            yield frame
            seen.add(frame)
            moving = None if frame in self._static else self._moving.get(frame)
            if moving:
                frame = moving[max(bisect_right(moving, stamp, key=_stamp) - 1, 0)].parent
            elif frame in self._static:
                frame = self._static[frame].parent

    def _at(self, child: str, stamp: int) -> NDArray[np.float64]:
        """Return where a frame is in its parent, (4, 4)."""
        moving = self._moving.get(child)
        if child in self._static or not moving:
            return self._static[child].pose
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

    def _sort(self) -> None:
        if not self._is_sorted:
            for moving in self._moving.values():
                moving.sort(key=_stamp)
            self._is_sorted = True


def _stamp(transform: Transform) -> int:
    return transform.stamp
