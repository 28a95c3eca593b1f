"""Goals and decisions in the words of a planner's log."""

import math

from active_recon.geometry.cameras import Camera
from active_recon.planner import Decision


def place_words(camera: Camera) -> str:
    """Return where a goal is."""
    return (f'azimuth {math.degrees(camera.azimuth):.1f}, elevation '
            f'{math.degrees(camera.elevation):.1f} degrees')


def instead_words(decision: Decision) -> str:
    """Return what follows in the place of a goal that was given up."""
    if decision.goal is not None:
        return f'the next best is {place_words(decision.goal.camera)}'
    if decision.reason == 'no_reachable_azimuth':
        return 'no reachable goal is left'
    return f'the episode ends: {decision.reason}'
