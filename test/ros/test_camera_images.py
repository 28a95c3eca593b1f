"""Images as cameras send them, over real DDS: compressed, in both forms, and too fast."""

from collections import Counter
import os
import signal

import cv2
from geometry_msgs.msg import PoseStamped
from msg_tools.images import image_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from sensor_msgs.msg import CameraInfo, CompressedImage, PointCloud2

from .conftest import FakeCamera

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def reconstructor(start_shared_node):
    return start_shared_node('reconstructor', take_views='all')


@pytest.fixture(scope='module')
def camera(shared_bench, reconstructor):
    return FakeCamera(shared_bench)


@pytest.fixture(scope='module')
def compressed(shared_bench, reconstructor):
    return shared_bench.advertise(CompressedImage, 'camera/image_raw/compressed')


def packed(image):
    """Return a raw image as a PNG, of the same stamp and the same pixels."""
    bgr = cv2.cvtColor(image_from_msg(image), cv2.COLOR_RGB2BGR)
    data = cv2.imencode('.png', bgr)[1].tobytes()
    return CompressedImage(header=image.header, format='png', data=data)


def stamps(heard):
    return [nanoseconds_from_stamp(msg.header.stamp) for msg in heard]


def sent_until_seen(bench, send, heard):
    """Send new images until one is seen, since best effort may lose some; return its stamp."""
    sent = []

    def seen():
        return [stamp for stamp in stamps(heard) if stamp in sent]

    for _ in range(30):
        sent.append(send())
        if found := bench.within(1.5, seen):  # the other form must have been silent for 1 s
            return found[-1]
    raise AssertionError('no view after images that are good')


def cells(heard, stamp):
    return next(bytes(msg.data) for msg in heard if stamps([msg]) == [stamp])


def test_of_images_that_came_too_fast_the_newest_is_a_view_and_the_others_are_counted(
        shared_bench, reconstructor, camera):
    def counts():
        return shared_bench.counts('reconstructor')

    def told():
        return counts().get('images', 0) + counts().get('dropped/unheard', 0)

    def settled():
        used = sum(count for key, count in counts().items()
                   if key in ('views', 'dropped/overtaken') or key.startswith('refused/'))
        return counts().get('images', 0) == used > 0

    camera.show()
    shared_bench.until(settled, 'every image to be a view or refused')
    told_before, views_before = told(), counts()['views']
    os.kill(reconstructor.pid, signal.SIGSTOP)  # as if a view took long
    begin = shared_bench.now()
    for later in range(40):
        camera.send(*camera.messages(begin + later * 1_000_000))
    os.kill(reconstructor.pid, signal.SIGCONT)
    sent = 40

    def send():
        nonlocal sent
        sent += 1
        image, info, pose = camera.messages()
        camera.send(image, info, pose)
        return nanoseconds_from_stamp(image.header.stamp)

    sent_until_seen(shared_bench, send, camera.occupancy)
    shared_bench.until(lambda: told() - told_before == sent, 'every image to be heard or missed')
    shared_bench.until(settled, 'every image to be a view, overtaken or refused')
    assert counts().get('dropped/unheard', 0) > 0
    assert counts()['views'] - views_before < sent


def test_who_sends_both_forms_is_heard_once(shared_bench, camera, compressed):
    views = shared_bench.subscribe(PoseStamped, 'view')

    def send():
        image, info, pose = camera.messages()
        camera.send(image, info, pose)
        compressed.publish(packed(image))
        return nanoseconds_from_stamp(image.header.stamp)

    def passed_over():
        return shared_bench.counts('reconstructor').get('images_in_the_other_form')

    for _ in range(6):
        sent_until_seen(shared_bench, send, views)
        if shared_bench.within(2.0, passed_over):
            break
    assert passed_over()
    assert len(set(stamps(views))) == len(views)
    assert not shared_bench.counts('reconstructor').get('refused/duplicate')


def test_a_compressed_image_gives_what_the_raw_one_does(shared_bench, camera, compressed):
    clouds = shared_bench.subscribe(PointCloud2, 'probabilities')

    def send(form):
        assert shared_bench.call('start_episode').success
        image, info, pose = camera.messages()
        camera.send(None if form == 'compressed' else image, info, pose)
        if form == 'compressed':
            compressed.publish(packed(image))
        return nanoseconds_from_stamp(image.header.stamp)

    first, second = (cells(clouds, sent_until_seen(shared_bench, lambda f=form: send(f), clouds))
                     for form in ('raw', 'compressed'))
    assert first == second


def test_a_damaged_image_is_refused_and_the_next_one_is_a_view(
        shared_bench, reconstructor, camera, compressed):
    def refused():
        image, info, pose = camera.messages()
        damaged = packed(image)
        damaged.data = damaged.data[:-2000]
        camera.send(info=info, pose=pose)
        compressed.publish(damaged)
        return shared_bench.within(
            2.0, lambda: shared_bench.counts('reconstructor').get('refused/encoding'))

    shared_bench.until(refused, 'the damaged image to be refused')
    assert reconstructor.log('refused: compressed image not readable: expected JPEG or PNG')

    def send():
        image, info, pose = camera.messages()
        camera.send(info=info, pose=pose)
        compressed.publish(packed(image))
        return nanoseconds_from_stamp(image.header.stamp)

    sent_until_seen(shared_bench, send, camera.occupancy)


def flood(bench, camera, size):
    """
    Have images wait for one pose until all of them came, so that they become complete at once.

    Return the stamp of the newest and what the node has counted since; None where best effort
    lost something, or the node waited in vain for the pose.
    """
    def counted():
        return Counter(bench.counts('reconstructor'))

    def came():
        """Whether what is sent last on each topic was heard: nothing of before is on its way."""
        since = counted() - before
        return since['refused/duplicate'] and since['refused/camera_info']

    episode = bench.call('start_episode').message
    bench.until(lambda: bench.state('reconstructor').facts.get('Episode') == episode,
                'the counters as they are when the episode begins')
    before, begin = counted(), bench.now()
    images, infos, poses = zip(*(
        camera.messages(begin + later * 1_000_000) for later in range(size + 2)), strict=True)
    camera.send(pose=poses[0])
    for info in infos[1:-1]:
        camera.send(info=info)
    camera.send(info=CameraInfo(header=infos[-1].header))  # of no image at all: refused
    for image in (*images[1:-1], images[-2]):  # the last one twice: refused
        camera.send(image)
    if not bench.within(5.0, came):
        return None
    camera.send(pose=poses[-1])
    bench.within(5.0, lambda: (counted() - before)['views'])
    since = counted() - before
    lost = sum(since[key] for key in (
        'dropped/unheard', 'images_unused', 'refused/no_camera_info', 'refused/no_pose'))
    return None if lost or not since['views'] else (stamps(images)[-2], since)


def test_of_images_faster_than_views_the_newest_win_and_the_others_are_counted(
        shared_bench, camera):
    views = shared_bench.subscribe(PoseStamped, 'view')
    newest, since = next(filter(None, (flood(shared_bench, camera, 8) for _ in range(30))))
    assert since['images'] == 8 + 1
    assert (since['views'], since['dropped/overtaken'], since['refused/duplicate']) == (1, 7, 1)
    shared_bench.until(lambda: views, 'the view')
    assert stamps(views)[-1] == newest
