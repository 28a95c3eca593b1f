"""Fault injection for the simulated camera: lost, late, repeated and corrupt messages."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import math

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import Camera
import numpy as np
from numpy.typing import NDArray

_SHARE = 1.0
FAULTS: Mapping[str, tuple[float, str]] = {
    'drop_images': (_SHARE, 'share of the images that are not sent'),
    'delay_images': (10.0, 'delay of the images after their pose, s'),
    'duplicate_images': (_SHARE, 'share of the images that are sent twice'),
    'reorder_images': (_SHARE, 'share of the images that are sent after the next one'),
    'corrupt_images': (_SHARE, 'share of the images that are truncated'),
    'wrong_camera_info': (_SHARE, 'share of the camera infos with a wrong image size'),
    'drop_camera_info': (_SHARE, 'share of the camera infos that are not sent'),
    'pose_noise': (math.pi, 'standard deviation of the azimuth in the poses, rad'),
    'drop_poses': (_SHARE, 'share of the poses that are not sent'),
    'stall_motor': (_SHARE, 'share of the seconds in which the motor stands still'),
    'restart': (_SHARE, 'share of the seconds in which the camera is off; it restarts at its '
                        'first azimuth, without a goal'),
}
"""The largest amount of each fault (the smallest is 0), and the meaning of the amount."""


def read_faults(entries: Iterable[str]) -> dict[str, float]:
    """
    Return the amount of each fault, from entries like 'drop_images:0.3'; '' is ignored.

    Raises ConfigError of the kind 'faults' on an unknown fault, one given twice, or an amount out
    of range.
    """
    amounts: dict[str, float] = {}
    for entry in filter(None, entries):
        name, _, text = entry.partition(':')
        if name not in FAULTS:
            raise ConfigError('faults: unknown fault: expected NAME:AMOUNT with a name of '
                              f'{", ".join(FAULTS)}, got {entry!r}', 'faults')
        if name in amounts:
            raise ConfigError(f'faults: {name} given twice: expected it once, got it again: '
                              f'{entry!r}', 'faults')
        most, meaning = FAULTS[name]
        try:
            amount = float(text)
        except ValueError:
            amount = math.nan
        if not 0 <= amount <= most:
            raise ConfigError(f'faults: wrong amount of {name}: expected a number from 0 to '
                              f'{most:g} ({meaning}), got {entry!r}', 'faults')
        amounts[name] = amount
    return amounts


@dataclass(frozen=True, eq=False)
class Shot:
    """An image, (H, W, 3) uint8 RGB, its camera, and its stamp in nanoseconds."""

    stamp: int
    image: NDArray[np.uint8]
    camera: Camera


@dataclass(frozen=True, eq=False)
class Sent:
    """
    A message to send now: the 'image', 'camera_info' or 'pose' of a shot.

    `kept` is the fraction of an image's bytes, [0, 1], that is sent.
    """

    part: str
    shot: Shot
    kept: float = 1.0


class CameraFaults:
    """
    Injects faults into a camera's stream; times are in seconds of any one clock.

    The same seed, faults, shots and times give the same stream. `amounts` is as `read_faults`
    returns it.
    """

    def __init__(self, amounts: Mapping[str, float], seed: int = 0) -> None:
        self._rng = np.random.default_rng(seed)
        self._held: Sent | None = None
        self._waiting: deque[tuple[float, Sent]] = deque()
        self._drawn: dict[str, tuple[tuple[int, float], bool]] = {}
        self._stood = 0.0
        self._last = self._sent_at = -math.inf
        self.change(amounts)

    def change(self, amounts: Mapping[str, float]) -> None:
        """Replace the faults; messages that are already delayed are still sent."""
        self._amounts = dict(amounts)

    def is_there(self, now: float) -> bool:
        """Return whether the camera is on; when it is off, delayed messages are lost."""
        if not self._this_second('restart', now):
            return True
        self._held = None
        self._waiting.clear()
        return False

    def motor_time(self, now: float) -> float:
        """Return the time of the motor, seconds, which stops while the motor is stalled."""
        if self._this_second('stall_motor', now) and self._last > -math.inf:
            self._stood += max(now - self._last, 0.0)
        self._last = now
        return now - self._stood

    def sent(self, shot: Shot, now: float) -> list[Sent]:
        """Return the messages to send after this shot, images last."""
        parts = []
        if not self._happens('drop_poses'):
            parts.append(Sent('pose', self._with_noise(shot)))
        if not self._happens('drop_camera_info'):
            parts.append(Sent('camera_info', self._of_another_size(shot)))
        if now < self._sent_at:  # the clock went back: what waits is of the time before
            self._held = None
            self._waiting.clear()
        self._sent_at = now
        due = now + self._amounts.get('delay_images', 0.0)
        self._waiting.extend((due, image) for image in self._images(shot))
        while self._waiting and self._waiting[0][0] <= now:
            parts.append(self._waiting.popleft()[1])
        return parts

    def _images(self, shot: Shot) -> list[Sent]:
        """Return the images to send or delay with this shot."""
        if self._happens('drop_images'):
            return []
        image = Sent('image', shot)
        if self._happens('corrupt_images'):
            image = replace(image, kept=float(self._rng.random()))
        if self._held is not None:
            images, self._held = [image, self._held], None
        elif self._happens('reorder_images'):
            images, self._held = [], image
        else:
            images = [image]
        return [each for each in images
                for _ in range(2 if self._happens('duplicate_images') else 1)]

    def _with_noise(self, shot: Shot) -> Shot:
        turn = self._amounts.get('pose_noise', 0.0) * self._rng.standard_normal()
        if not turn:
            return shot
        pose = shot.camera.pose.copy()
        cosine, sine = math.cos(turn), math.sin(turn)
        pose[:2] = np.array([[cosine, -sine], [sine, cosine]]) @ pose[:2]
        return replace(shot, camera=replace(shot.camera, pose=pose))

    def _of_another_size(self, shot: Shot) -> Shot:
        if not self._happens('wrong_camera_info'):
            return shot
        lens = shot.camera.intrinsics
        wrong = lens.resized(2 * lens.width, 2 * lens.height)
        return replace(shot, camera=replace(shot.camera, intrinsics=wrong))

    def _happens(self, name: str) -> bool:
        return bool(self._rng.random() < self._amounts.get(name, 0.0))

    def _this_second(self, name: str, now: float) -> bool:
        """Return whether a fault is on in this second; drawn anew where its amount changes."""
        drawn_for = math.floor(now), self._amounts.get(name, 0.0)
        if name not in self._drawn or self._drawn[name][0] != drawn_for:
            self._drawn[name] = drawn_for, self._happens(name)
        return self._drawn[name][1]
