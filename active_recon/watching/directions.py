"""Where to stand for the next photo, in words for someone with a camera in the hand."""

import math

from active_recon.geometry.cameras import azimuth_difference, Camera, TURN

_STAY = math.radians(8)  # smaller differences are not worth a step
_PARTS = ((12, 'a twelfth of a turn'), (8, 'an eighth of a turn'), (6, 'a sixth of a turn'),
          (4, 'a quarter of a turn'), (3, 'a third of a turn'), (12 / 5, 'nearly half a turn'),
          (2, 'half a turn'))
"""Parts of a turn that can be paced, as divisors."""
_ROUNDED_DEG = 5
_SAME_DISTANCE = 0.15  # relative


def where_to_stand(goal: Camera, last: Camera, metric: bool) -> str:
    """
    Return the way from the last photo's camera to a goal's, both in the object frame.

    Left and right are those of someone who looks at the object. `metric`: whether lengths are
    in metres for certain.
    """
    turn = float(azimuth_difference(goal.azimuth, last.azimuth))
    tilt = goal.elevation - last.elevation
    height = '' if abs(tilt) < _STAY else ', higher' if tilt > 0 else ', lower'
    degrees = _ROUNDED_DEG * round(math.degrees(goal.elevation) / _ROUNDED_DEG)
    words = f'{_way(turn)}{height}, camera at {degrees} degrees'
    if not metric or abs(goal.distance - last.distance) < _SAME_DISTANCE * last.distance:
        return words
    return f'{words}, {goal.distance * 100:.0f} cm from the object'


def _way(turn: float) -> str:
    """Return the part of a turn, radians in [-pi, pi), and its side."""
    away = abs(turn)
    if away < _STAY:
        return 'from the side of the last photo'
    words = min(_PARTS, key=lambda part: abs(TURN / part[0] - away))[1]
    if words == 'half a turn':
        return 'half a turn from the last photo, at the opposite side'
    # Who looks at the object goes to the right where the azimuth grows
    return f'{words} to the {"right" if turn > 0 else "left"} of the last photo'
