"""Comparison of a replay with the recording: the same bits, or the largest deviation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

from active_recon.acquisition.goals import Goal
from active_recon.bags.replay.replay import ReplayedEpisode, ReplayStep
from active_recon.bags.runs.run import RecordedGoal
from active_recon.geometry.cameras import Camera
from active_recon.geometry.view_distance import view_distance
from active_recon.quality.quality import Quality
from active_recon.volumes.voxels import PUBLISHED_FLOOR, VoxelGrid
from msg_tools.cameras import pose_through_msg
import numpy as np

TOLERANCES: Mapping[str, float] = {
    'probabilities': 1e-4,
    'occupancy': 1e-4,
    'latent': 1e-4,
    'entropy': 1e-4,
    'quality': 1e-3,
    'goal': 1e-4,
    'scores': 1e-3,
    'stop': 0.0,
}
"""The accepted deviations on another machine: absolute for probabilities and latents, relative for
entropy, shares for quality, radians between the views for goals, in the policy's units for scores;
none for the end of an episode."""

SAME_BITS, WITHIN_TOLERANCE, DIFFERENT, NOTHING_RECORDED = (
    'same bits', 'within tolerance', 'different', 'nothing recorded')


@dataclass
class Deviation:
    """Of one quantity: the numbers of values compared and with the same bits, and the largest."""

    tolerance: float
    compared: int = 0
    same: int = 0
    largest: float = 0.0

    @property
    def verdict(self) -> str:
        """One of the four verdicts above."""
        if not self.compared:
            return NOTHING_RECORDED
        if self.same == self.compared:
            return SAME_BITS
        return WITHIN_TOLERANCE if self.largest <= self.tolerance else DIFFERENT


@dataclass(frozen=True)
class Comparison:
    """The deviation of each quantity, by the names of TOLERANCES."""

    deviations: Mapping[str, Deviation] = field(default_factory=lambda: {
        name: Deviation(tolerance) for name, tolerance in TOLERANCES.items()})

    @property
    def verdict(self) -> str:
        """The worst verdict of the recorded quantities."""
        verdicts = {deviation.verdict for deviation in self.deviations.values()}
        return next((word for word in (DIFFERENT, WITHIN_TOLERANCE, SAME_BITS)
                     if word in verdicts), NOTHING_RECORDED)


def compare(episodes: Sequence[ReplayedEpisode], threshold: float) -> Comparison:
    """
    Compare all that was recorded of each view with its replay.

    `threshold` is the replay's threshold of occupied cells. An episode that began before the
    recording is left out: the network had seen more views than the bag has.
    """
    comparison = Comparison()
    for episode in episodes:
        if episode.recorded.begun_before:
            continue
        for step in episode.steps:
            done = episode.recorded.done_after(step.recorded)
            for name, same, apart in _deviations(step, done, threshold):
                deviation = comparison.deviations[name]
                deviation.compared += 1
                deviation.same += same
                # NaN counts as infinite
                deviation.largest = max(deviation.largest, apart if apart == apart else np.inf)
    return comparison


def _deviations(step: ReplayStep, done: str,
                threshold: float) -> Iterator[tuple[str, bool, float]]:
    """Yield each recorded quantity, whether its bits are the same, and the deviation."""
    recorded, grid = step.recorded, step.reconstruction.grid
    if recorded.reconstruction is not None:
        yield 'probabilities', *_cells(recorded.reconstruction, grid, PUBLISHED_FLOOR)
    if recorded.occupied is not None:
        yield 'occupancy', *_cells(recorded.occupied, grid, threshold)
    if recorded.latent is not None:
        latent = step.reconstruction.latent
        yield ('latent', np.array_equal(recorded.latent, latent),
               _largest(recorded.latent, latent))
    if recorded.entropy is not None:
        entropy = grid.entropy()
        yield ('entropy', recorded.entropy == entropy,
               abs(recorded.entropy - entropy) / max(abs(recorded.entropy), 1e-9))
    judged = step.reconstruction.quality
    if recorded.quality is not None and judged is not None:
        if recorded.quality.promise_learned is None:
            judged = replace(judged, promise_learned=None)
        yield 'quality', recorded.quality == judged, _quality(recorded.quality, judged)
    if step.decision is None:
        return
    if done != 'stopped' and (recorded.goal is not None or done):  # a service call has no time
        stopped_alike = step.decision.reason == done
        yield 'stop', stopped_alike, 0.0 if stopped_alike else np.inf
    if recorded.goal is not None and step.decision.goal is not None:
        yield from _goal(recorded.goal, step.decision.goal)


def _goal(recorded: RecordedGoal, goal: Goal) -> Iterator[tuple[str, bool, float]]:
    yield ('goal', _is_pose_of(recorded.camera, goal.camera),
           view_distance(recorded.camera, goal.camera))
    if recorded.scores is not None:
        yield ('scores', np.array_equal(recorded.scores, goal.scores),
               _largest(recorded.scores, goal.scores))


def _is_pose_of(recorded: Camera, camera: Camera) -> bool:
    """Return whether a pose has the bits of the camera's pose, before or after its message."""
    return any(np.array_equal(recorded.pose, pose)
               for pose in (camera.pose, pose_through_msg(camera.pose)))


def _cells(recorded: VoxelGrid, grid: VoxelGrid, above: float) -> tuple[bool, float]:
    """
    Compare a recorded cloud of the cells above a threshold with the whole grid.

    A cell that is not in the cloud was at most at the threshold.
    """
    known = recorded.as_fine_as(grid).occupancy
    if known.shape != grid.occupancy.shape:
        return False, np.inf
    apart = np.where(known > 0, np.abs(known - grid.occupancy),
                     np.maximum(grid.occupancy - np.float32(above), 0))
    return np.array_equal(known, grid.above(above).occupancy), float(apart.max())


def _quality(recorded: Quality, replayed: Quality) -> float:
    """Return the largest deviation of two qualities' numbers; infinite for other suspects."""
    if recorded.suspect != replayed.suspect:
        return np.inf
    return float(max(abs(value - getattr(replayed, name))
                     for name, value in asdict(recorded).items() if isinstance(value, float)))


def _largest(recorded: np.ndarray, replayed: np.ndarray) -> float:
    if recorded.shape != replayed.shape:
        return np.inf
    return float(np.abs(recorded - replayed).max(initial=0))
