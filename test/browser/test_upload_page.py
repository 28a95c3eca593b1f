"""The upload page in a real browser: a photo is chosen, sent, and answered."""

import threading

from active_recon.acquisition.goals import Goal
from active_recon.geometry.cameras import orbit_camera
from active_recon.watching.advice import Advice
from active_recon.watching.upload import LARGEST_UPLOAD, UploadServer
from active_recon.watching.watcher import Progress, Verdicts
import numpy as np
from PIL import Image
import pytest

pytestmark = pytest.mark.browser
PHONE = (390, 844)


def test_a_phone_sends_a_photo_and_is_told_where_to_stand(chromium, tmp_path):
    folder = tmp_path / 'photos'
    folder.mkdir()
    Image.new('RGB', (40, 30), (9, 99, 199)).save(tmp_path / 'mine.jpg')
    verdicts, now = Verdicts(), [Progress()]
    server = UploadServer(folder, lambda: now[0], verdicts)
    try:
        chromium.open(server.url, PHONE)
        chromium.until(lambda: 'Waiting for the first photo.' in chromium.text(), 'the state')
        chromium.driver.find_element('id', 'photo').send_keys(str(tmp_path / 'mine.jpg'))
        chromium.until(lambda: list(folder.glob('phone-*.jpg')), 'the photo')
        now[0] = Progress(['Next: <b>half</b> a turn.'], sketch=np.zeros((9, 9, 3), np.uint8))
        threading.Timer(0.1, verdicts.put, ('phone-0001.jpg', '')).start()
        chromium.until(lambda: 'Taken in as phone-0001.jpg.' in chromium.text(), 'the verdict')
        assert 'Next: <b>half</b> a turn.' in chromium.text()  # words, never markup
        sketch = chromium.driver.find_element('id', 'sketch')
        chromium.until(lambda: sketch.get_property('naturalWidth') == 9, 'the sketch')
        assert chromium.run('return document.documentElement.scrollWidth') <= PHONE[0]
        assert not chromium.errors()
    finally:
        server.close()


def test_who_cannot_stand_there_is_told_another_place(chromium, tmp_path):
    def there(words):
        return Progress([words], advice=Advice(Goal(orbit_camera(0.0), [], np.zeros(0)), None))

    now = [Progress()]
    server = UploadServer(tmp_path, lambda: now[0], Verdicts(), skip=lambda seconds: (
        now.__setitem__(0, there('Next: a quarter of a turn.'))))
    try:
        chromium.open(server.url, PHONE)
        chromium.until(lambda: 'Waiting for the first photo.' in chromium.text(), 'the state')
        button = chromium.driver.find_element('id', 'skip')
        assert not button.is_displayed()
        now[0] = there('Next: half a turn.')
        chromium.until(button.is_displayed, 'the button')
        button.click()
        chromium.until(lambda: 'Next: a quarter of a turn.' in chromium.text(), 'another place')
        assert 'half a turn' not in chromium.text() and not chromium.errors()
    finally:
        server.close()


def test_what_became_of_a_photo_stays_where_the_computer_was_away_before(chromium, tmp_path):
    Image.new('RGB', (40, 30), (9, 99, 199)).save(tmp_path / 'mine.jpg')
    verdicts, now = Verdicts(), [Progress()]
    verdicts.put('phone-0001.jpg', 'phone-0001.jpg: no board seen in it')
    server = UploadServer(tmp_path, lambda: now[0], verdicts)
    try:
        chromium.open(server.url, PHONE)
        online(chromium, False)
        chromium.until(lambda: 'The computer does not answer.' in chromium.text(), 'silence')
        online(chromium, True)
        chromium.driver.find_element('id', 'photo').send_keys(str(tmp_path / 'mine.jpg'))
        chromium.until(lambda: 'no board seen in it' in chromium.text(), 'the verdict')
        now[0] = Progress(['Next: half a turn.'])
        chromium.until(lambda: 'Next: half a turn.' in chromium.text(), 'the state')
        assert 'Left out: phone-0001.jpg: no board seen in it' in chromium.text()
    finally:
        online(chromium, True)
        server.close()


def test_a_photo_that_was_too_large_is_heard_of_again_once_it_is_smaller(chromium, tmp_path):
    (tmp_path / 'photos').mkdir()
    (tmp_path / 'mine.jpg').write_bytes(bytes(LARGEST_UPLOAD + 1))
    server = UploadServer(tmp_path / 'photos', Progress, Verdicts())
    try:
        chromium.open(server.url, PHONE)
        chromium.driver.find_element('id', 'photo').send_keys(str(tmp_path / 'mine.jpg'))
        chromium.until(lambda: 'Not sent: expected at most 30 MB' in chromium.text(), 'refusal')
        Image.new('RGB', (40, 30), (9, 99, 199)).save(tmp_path / 'mine.jpg')
        chromium.driver.find_element('id', 'photo').send_keys(str(tmp_path / 'mine.jpg'))
        chromium.until(lambda: list((tmp_path / 'photos').glob('phone-*.jpg')), 'the photo')
    finally:
        server.close()


def test_a_long_name_makes_the_page_no_wider_than_the_phone(chromium, tmp_path):
    name = f'IMG_{"0123456789" * 20}.jpg'
    server = UploadServer(tmp_path, lambda: Progress([f'Left out: {name}: no board']), Verdicts())
    try:
        chromium.open(server.url, PHONE)
        chromium.until(lambda: name in chromium.text(), 'the name')
        assert chromium.run('return document.documentElement.scrollWidth') <= PHONE[0]
    finally:
        server.close()


def online(chromium, there):
    chromium.driver.execute_cdp_cmd('Network.enable', {})
    chromium.driver.execute_cdp_cmd('Network.emulateNetworkConditions', {
        'offline': not there, 'latency': 0, 'downloadThroughput': -1, 'uploadThroughput': -1})
