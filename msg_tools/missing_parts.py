"""Why an image is refused that lacks its camera info or its pose: what came instead."""

from collections.abc import Iterable

_FAR = 1_000_000_000
"""Nanoseconds: what is further from an image has a stamp of another clock, or none."""


def no_camera_info(stamp: int, last: int | None) -> str:
    """Return why an image has none; `last` is the stamp of the last that came, None for none."""
    if last is None:
        came = 'none received'
    elif _is_unstamped(last, stamp):
        came = 'it comes without a stamp: let its publisher fill in header.stamp, as of the image'
    else:
        came = f'the last is of {seconds(last)}; it must have the stamp of its image'
    return f"no camera info of the image's stamp, {seconds(stamp)}: {came}"


def no_pose(stamp: int, nearby: Iterable[int], max_gap: float) -> str:
    """Return why an image has none within `max_gap` seconds; `nearby` are the nearest stamps."""
    by_distance = sorted(nearby, key=lambda each: abs(each - stamp))
    if not by_distance:
        came = 'none received'
    elif _is_unstamped(by_distance[0], stamp):
        came = 'but they come without a stamp: let their publisher fill in header.stamp'
    else:
        away = abs(by_distance[0] - stamp)
        came = f'the nearest is {away / 1e9:.3f} s away' + (
            '; are poses and images stamped by the same clock?' if away > _FAR else
            _other_side(stamp, *by_distance) if away <= max_gap * 1e9 else '')
    return (f'no pose for the image of {seconds(stamp)}: expected one of its stamp, or one before '
            f'and one after it within {max_gap:g} s, {came}')


def _other_side(stamp: int, nearest: int, *others: int) -> str:
    """Return what is wrong with the poses on the other side of an image than the nearest."""
    side = 'before' if nearest > stamp else 'after'
    across = [abs(each - stamp) for each in others if (each < stamp) == (nearest > stamp)]
    return (f', but that {side} the image {min(across) / 1e9:.3f} s' if across
            else f', but none came {side} the image')


def seconds(stamp: int) -> str:
    """Return a stamp in nanoseconds as text."""
    return f'{stamp / 1e9:.3f} s'


def _is_unstamped(came: int, stamp: int) -> bool:
    """Return whether a stamp was not filled in: 0, where the time is not that of a beginning."""
    return came == 0 and stamp > _FAR
