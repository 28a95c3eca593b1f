"""Images as cameras send them, over real DDS: compressed, in both forms, and too fast."""

import os
import signal

from conftest import FakeCamera
import cv2
from geometry_msgs.msg import PoseStamped
from msg_tools.images import image_from_msg
from msg_tools.stamps import nanoseconds_from_stamp
import pytest
from sensor_msgs.msg import CompressedImage, PointCloud2

pytestmark = pytest.mark.ros


@pytest.fixture
def reconstructor(start_node):
    return start_node('reconstructor', take_views='all')


@pytest.fixture
def camera(bench, reconstructor):
    return FakeCamera(bench)


@pytest.fixture
def compressed(bench, reconstructor):
    return bench.advertise(CompressedImage, 'camera/image_raw/compressed')


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

    for _ in range(6):
        sent.append(send())
        if found := bench.within(5.0, seen):
            return found[-1]
    raise AssertionError('no view after images that are good')


def cells(heard, stamp):
    return next(bytes(msg.data) for msg in heard if stamps([msg]) == [stamp])


def test_a_compressed_image_gives_what_the_raw_one_does(bench, camera, compressed):
    clouds = bench.hear(PointCloud2, 'probabilities')

    def send(form):
        assert bench.call('start_episode').success
        image, info, pose = camera.messages()
        camera.send(None if form == 'compressed' else image, info, pose)
        if form == 'compressed':
            compressed.publish(packed(image))
        return nanoseconds_from_stamp(image.header.stamp)

    first, second = (cells(clouds, sent_until_seen(bench, lambda f=form: send(f), clouds))
                     for form in ('raw', 'compressed'))
    assert first == second


def test_who_sends_both_forms_is_heard_once(bench, reconstructor, camera, compressed):
    views = bench.hear(PoseStamped, 'view')

    def send():
        image, info, pose = camera.messages()
        camera.send(image, info, pose)
        compressed.publish(packed(image))
        return nanoseconds_from_stamp(image.header.stamp)

    def passed_over():
        return bench.counts('reconstructor').get('images_in_the_other_form')

    for _ in range(6):
        sent_until_seen(bench, send, views)
        if bench.within(2.0, passed_over):
            break
    assert passed_over()
    assert len(set(stamps(views))) == len(views)
    assert not reconstructor.log('refused')


def test_a_damaged_image_is_refused_and_the_next_one_is_a_view(bench, reconstructor, camera,
                                                               compressed):
    def refused():
        image, info, pose = camera.messages()
        damaged = packed(image)
        damaged.data = damaged.data[:-2000]
        camera.send(info=info, pose=pose)
        compressed.publish(damaged)
        return bench.within(2.0, lambda: bench.counts('reconstructor').get('refused/encoding'))

    bench.until(refused, 'the damaged image to be refused')
    assert 'expected a compressed image as JPEG or PNG' in reconstructor.log('refused')[0]
    camera.show()


def test_of_images_that_came_too_fast_the_newest_is_a_view_and_the_others_are_counted(
        bench, reconstructor, camera):
    def accounted():
        counts = bench.counts('reconstructor')
        return counts.get('images', 0) + counts.get('dropped/unheard', 0)

    camera.show()
    bench.until(lambda: bench.counts('reconstructor').get('views', 0)
                == bench.counts('reconstructor').get('images', -1), 'all images to be views')
    before, views_before = accounted(), bench.counts('reconstructor')['views']
    os.kill(reconstructor.pid, signal.SIGSTOP)  # as if a view took long
    begin = bench.now()
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

    sent_until_seen(bench, send, camera.occupancy)
    bench.until(lambda: accounted() - before == sent, 'every image to be heard or counted as lost')
    counts = bench.counts('reconstructor')
    assert counts['dropped/unheard'] >= 20
    assert counts['views'] - views_before <= 15
    assert counts['dropped/overtaken'] >= 1
    refused = sum(count for key, count in counts.items() if key.startswith('refused/'))
    assert counts['images'] == counts['views'] + counts['dropped/overtaken'] + refused
