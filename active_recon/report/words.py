"""The words of the page for what nodes and bags call by short names, and for numbers of them."""

_REFUSED = {
    'no_pose': 'no camera pose arrived close enough to {them} in time (late poses)',
    'no_camera_info': 'the camera info of {their} stamp never came',
    'camera_info': 'the camera info did not fit {them}',
    'last_episode': '{they} older than the episode',
    'duplicate': '{they} there already',
    'out_of_order': '{they} stamped earlier than one before',
    'image_size': '{their} size was not what was announced',
    'encoding': '{their} encoding is not known',
    'no_mask': 'no mask of {their} stamp came',
    'no_object': 'no object stood out from the background',
    'out_of_image': 'too much of the object was outside of the image',
}
_WARNED = {
    'stalled': 'a camera that stood still away from its goal',
    'noisy_poses': 'poses that jump',
    'goal_timeout': 'a goal that was not reached in time',
    'silent_camera': 'a camera that had gone silent',
    'silent_images': 'images that came no longer',
    'silent_camera_info': 'camera info that came no longer',
    'silent_poses': 'poses that came no longer',
    'missing_images': 'images that did not come with the rest',
    'missing_poses': 'poses that did not come with the rest',
    'late_images': 'images that came late',
    'never_heard': 'an input that never spoke',
    'no_publisher': 'a topic without a publisher',
    'lost': 'messages that did not arrive',
    'qos': 'QoS profiles that do not fit',
}
_KEYS = {
    'images_unused': 'images left out',
    'images_in_the_other_form': 'images that came compressed too',
    'clock_jumps': 'jumps of the clock',
    'dropped/unheard': 'images lost on the way',
    'dropped/overtaken': 'views overtaken by a newer one',
    'dropped/last_episode': 'messages of the episode before',
    'weights_sha256': 'weights (SHA-256)',
    'config_sha256': 'sizes of the network (SHA-256)',
    'needs_front': "needs the object's front",
    'lost': 'messages that did not arrive',
}


def counted(count: int, thing: str) -> str:
    """Return how many there are of a thing: '1 image', '2 images'."""
    return f'{count} {thing}{"" if count == 1 else "s"}'


def times(count: int) -> str:
    """Return how often: 'once', 'twice', '3 times'."""
    return {1: 'once', 2: 'twice'}.get(count, f'{count} times')


def refused(kind: str, count: int) -> str:
    """Return in words how many were refused and why, by the short name of the reason."""
    one = count == 1
    if kind not in _REFUSED:
        return (f'{counted(count, "message")} {"was" if one else "were"} refused '
                f'({kind.replace("_", " ")})')
    why = _REFUSED[kind].format(them='it' if one else 'them', their='its' if one else 'their',
                                they='it was' if one else 'they were')
    return f'{counted(count, "image")} {"was" if one else "were"} dropped: {why}'


def warned(kind: str) -> str:
    """Return in words of what a node warned, by its short name."""
    group, _, topic = kind.partition('/')
    words = _WARNED.get(group, group.replace('_', ' '))
    return f'{words} ({topic})' if topic else words


def key_words(key: str) -> str:
    """Return in words what a counter, a parameter or a record of a bag is called."""
    if key in _KEYS:
        return _KEYS[key]
    group, _, kind = key.partition('/')
    if group == 'refused':
        return f'refused: {kind.replace("_", " ")}'
    if group == 'warned':
        return f'warned of {warned(kind)}'
    return key.replace('_', ' ').replace('/', ': ')
