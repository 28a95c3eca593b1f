"""A recorded episode about another middle: its cameras in an object frame that is moved."""

from collections.abc import Sequence
from dataclasses import replace

from active_recon.bags.runs.run import Candidates, RecordedEpisode, RecordedGoal, RecordedView
from active_recon.bags.runs.scene import Scene
from active_recon.geometry.cameras import Camera, wrap_azimuth
import numpy as np


def about(episode: RecordedEpisode, centre: Sequence[float]) -> RecordedEpisode:
    """
    Return the episode in an object frame whose origin is at `centre`, (3,), of its own, metres.

    That frame is parallel to its own. What was reconstructed stays as it is.
    """
    first = None if episode.first_goal is None else _of_goal(episode.first_goal, centre)
    return replace(episode, first_goal=first,
                   views=[_of_view(view, centre) for view in episode.views])


def _of_view(view: RecordedView, centre: Sequence[float]) -> RecordedView:
    depth = view.depth
    if depth is not None and depth.camera is not None:
        depth = replace(depth, camera=_moved(depth.camera, centre))
    return replace(view, camera=_moved(view.camera, centre), depth=depth,
                   goal=None if view.goal is None else _of_goal(view.goal, centre))


def _of_goal(goal: RecordedGoal, centre: Sequence[float]) -> RecordedGoal:
    found = goal.candidates
    if found is not None:
        positions = found.positions - centre
        found = Candidates(positions, np.asarray(wrap_azimuth(
            np.arctan2(positions[:, 1], positions[:, 0]))))
    return replace(goal, camera=_moved(goal.camera, centre), candidates=found,
                   replacements=[_of_goal(each, centre) for each in goal.replacements])


def _moved(camera: Camera, centre: Sequence[float]) -> Camera:
    return replace(camera, pose=Scene(object_position=centre).about_object(camera.pose))
