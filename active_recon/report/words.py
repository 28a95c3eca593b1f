"""The page's texts for counters, warnings and record keys, and for their counts."""

from collections.abc import Mapping, Sequence

_REFUSED = {
    'no_pose': 'no camera pose arrived close enough to {them} in time (late poses)',
    'no_camera_info': 'no camera info of {their} stamp arrived',
    'camera_info': 'the camera info did not match {them}',
    'last_episode': '{they} older than the episode',
    'duplicate': '{they} received before',
    'out_of_order': '{they} stamped earlier than one before',
    'image_size': '{their} size was invalid',
    'encoding': '{their} encoding is not supported',
    'no_mask': 'no mask of {their} stamp arrived',
    'no_object': 'no object was found in front of the background',
    'out_of_image': 'too much of the object was outside of the image',
}
_WARNED = {
    'unusual_views': 'views unlike those it knows',
    'cube': 'a cube that does not fit the object',
    'learned_policy': 'a view policy that was learned for other weights',
    'weights': 'a reconstructor with other weights than the planner',
    'stalled': 'a camera that stood still away from its goal',
    'noisy_poses': 'poses that jump',
    'goal_timeout': 'a goal that was not reached in time',
    'silent_camera': 'a camera that stopped sending',
    'silent_images': 'images that stopped arriving',
    'silent_camera_info': 'camera info that stopped arriving',
    'silent_poses': 'poses that stopped arriving',
    'missing_images': 'missing images',
    'missing_poses': 'missing poses',
    'late_images': 'late images',
    'never_heard': 'an input without messages',
    'no_publisher': 'a topic without a publisher',
    'lost': 'messages that did not arrive',
    'depth': 'a depth image that could not be used',
    'no_depth': 'a view without a depth image',
    'qos': 'incompatible QoS profiles',
}
_KEYS = {
    'images_unused': 'unused images',
    'images_in_the_other_form': 'images also received in the other form',
    'clock_jumps': 'jumps of the clock',
    'dropped/unheard': 'images lost on the way',
    'dropped/overtaken': 'images replaced by a newer one',
    'dropped/last_episode': 'messages of the episode before',
    'weights_sha256': 'weights (SHA-256)',
    'config_sha256': 'network configuration (SHA-256)',
    'needs_front': "needs the object's front",
    'lost': 'messages that did not arrive',
}


def counted(count: int, thing: str) -> str:
    """Return a count with its noun: '1 image', '2 images'."""
    return f'{count} {thing}{"" if count == 1 else "s"}'


def view_numbers(numbers: Sequence[int]) -> str:
    """Return the numbers of views, in their order: 'view 3', 'views 1, 2, 5 to 9'."""
    rows: list[list[int]] = []
    for number in numbers:
        if rows and number == rows[-1][-1] + 1:
            rows[-1].append(number)
        else:
            rows.append([number])
    words = [f'{row[0]} to {row[-1]}' if len(row) > 2 else ', '.join(map(str, row))
             for row in rows]
    return f'view{"" if len(numbers) == 1 else "s"} {", ".join(words)}'


def times(count: int) -> str:
    """Return 'once', 'twice', '3 times'."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')


def refused(kind: str, count: int) -> str:
    """Return the text for a count of rejected messages, by the key of the reason."""
    one = count == 1
    if kind not in _REFUSED:
        return (f'{counted(count, "message")} {"was" if one else "were"} rejected '
                f'({kind.replace("_", " ")})')
    why = _REFUSED[kind].format(them='it' if one else 'them', their='its' if one else 'their',
                                they='it was' if one else 'they were')
    return f'{counted(count, "image")} {"was" if one else "were"} dropped: {why}'


def refusals(counts: Mapping[str, int]) -> list[str]:
    """Return the texts for all rejected messages among the counters of a node."""
    return [refused(key.removeprefix('refused/'), count) for key, count in sorted(counts.items())
            if key.startswith('refused/') and count > 0]


def warned(kind: str) -> str:
    """Return the text for a node's warning, by its key."""
    group, _, topic = kind.partition('/')
    words = _WARNED.get(group, group.replace('_', ' '))
    return f'{words} ({topic})' if topic else words


def key_words(key: str) -> str:
    """Return the text for the key of a counter or of a record in a bag."""
    if key in _KEYS:
        return _KEYS[key]
    group, _, kind = key.partition('/')
    if group == 'refused':
        return f'rejected: {kind.replace("_", " ")}'
    if group == 'warned':
        return f'warned of {warned(kind)}'
    return key.replace('_', ' ').replace('/', ': ')
