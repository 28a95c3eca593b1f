"""The upload page: only who has its address may send photos, and only photos are kept."""

from contextlib import contextmanager, suppress
import http.client
import ipaddress
import json
import socket
import threading
import time

from active_recon.errors import ConfigError
from active_recon.watching import upload as room
from active_recon.watching.upload import lan_address, LARGEST_UPLOAD, refusal, UploadServer
from active_recon.watching.watcher import Progress, Verdicts
import numpy as np
from PIL import Image
import pytest


def encoded(kind, folder, size=None):
    path = folder / f'made.{kind}'
    drawn = np.arange(1200, dtype=np.uint16).astype(np.uint8).reshape(20, 20, 3)
    (Image.new('1', size) if size else Image.fromarray(drawn)).save(path, kind)
    data = path.read_bytes()
    path.unlink()
    return data


@pytest.fixture
def verdicts():
    return Verdicts()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / 'photos').mkdir()
    return tmp_path / 'photos'


@pytest.fixture
def server(folder, verdicts, monkeypatch):
    monkeypatch.setattr(room, '_ANSWER_S', 0.05)
    progress = Progress(['Next: half a turn.'], sketch=np.zeros((4, 4, 3), np.uint8))
    served = UploadServer(folder, lambda: progress, verdicts)
    yield served
    served.close()


def ask(server, method, path, body=None, headers=()):
    """Return the status, the headers and the body of an answer."""
    connection = http.client.HTTPConnection(*server.server_address, timeout=10)
    try:
        connection.request(method, path, body, dict(headers))
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def send(server, photo, **rest):
    status, _, body = ask(server, 'POST', f'/{server.token}/photo', photo, **rest)
    return status, json.loads(body)


def test_the_page_is_at_its_secret_address_on_this_machine_only(server):
    host, port = server.server_address
    assert host == '127.0.0.1'
    assert server.url == f'http://127.0.0.1:{port}/{server.token}/'
    assert len(server.token) >= 20
    status, headers, body = ask(server, 'GET', f'/{server.token}/')
    assert status == 200 and b'capture="environment"' in body and b'NONCE' not in body
    assert "default-src 'none'" in headers['Content-Security-Policy']
    assert headers['Referrer-Policy'] == 'no-referrer'  # the address is a secret
    nonce = headers['Content-Security-Policy'].split("'nonce-")[1].split("'")[0]
    assert f'<script nonce="{nonce}">'.encode() in body
    _, again, _ = ask(server, 'GET', f'/{server.token}/')
    assert nonce not in again['Content-Security-Policy']


def test_a_place_is_skipped_before_the_answer_tells_another(folder, verdicts):
    now = [Progress(['Next: half a turn.'])]
    served = UploadServer(folder, lambda: now[0], verdicts, skip=lambda seconds: now.__setitem__(
        0, Progress([f'Next: a quarter of a turn, told within {seconds:.0f} s.'])))
    try:
        status, _, body = ask(served, 'POST', f'/{served.token}/skip')
        assert (status, json.loads(body)['lines']) == (
            200, ['Next: a quarter of a turn, told within 60 s.'])
        assert ask(served, 'POST', '/skip')[0] == ask(served, 'GET', f'/{served.token}/skip')[0]
    finally:
        served.close()


def test_every_run_has_another_address(server, folder, verdicts):
    other = UploadServer(folder, Progress, verdicts)
    try:
        assert other.token != server.token
        assert ask(other, 'GET', f'/{server.token}/')[0] == 404
    finally:
        other.close()


@pytest.mark.parametrize('path', ['/', '/photo', '/x/photo', '//photo', '/{}', '/{}x/photo',
                                  '/{}/../photo', '/{}/other', '/{}/photo/../../etc/passwd',
                                  '/%e4%00/photo'])
def test_any_other_address_is_not_found_and_keeps_nothing(server, folder, path):
    path = path.format(server.token)
    for method in ('GET', 'POST'):
        assert ask(server, method, path, encoded('PNG', folder) if method == 'POST' else None
                   )[0] == 404
    assert not list(folder.iterdir())


def test_a_photo_is_kept_under_a_name_of_the_server_s_own(server, folder):
    photo = encoded('JPEG', folder)
    headers = {'Content-Disposition': 'attachment; filename="../../evil.jpg"',
               'X-File-Name': '/etc/evil.jpg'}.items()
    status, told = send(server, photo, headers=headers)
    assert status == 200 and 'still being worked on' in told['verdict']
    assert send(server, encoded('PNG', folder))[0] == 200
    assert sorted(path.name for path in folder.iterdir()) == ['phone-0001.jpg', 'phone-0002.png']
    assert (folder / 'phone-0001.jpg').read_bytes() == photo
    assert [path.name for path in folder.parent.iterdir()] == ['photos']


def test_a_phone_s_photo_with_a_second_image_in_it_is_a_jpeg(server, folder):
    path = folder.parent / 'hdr.jpg'
    first, second = (Image.new('RGB', (20, 20), color) for color in ('red', 'blue'))
    first.save(path, 'MPO', save_all=True, append_images=[second])
    assert send(server, path.read_bytes())[0] == 200
    assert (folder / 'phone-0001.jpg').read_bytes() == path.read_bytes()


def test_the_answer_says_what_became_of_the_photo_and_where_to_stand(server, verdicts, folder):
    verdicts.put('phone-0001.jpg', 'phone-0001.jpg: no board seen in it')
    _, told = send(server, encoded('JPEG', folder))
    assert told['verdict'] == 'Left out: phone-0001.jpg: no board seen in it'
    assert told['lines'] == ['Next: half a turn.']
    assert told['sketch'].startswith('data:image/png;base64,')
    verdicts.put('phone-0002.jpg', '')
    assert send(server, encoded('JPEG', folder))[1]['verdict'] == 'Taken in as phone-0002.jpg.'
    status, _, body = ask(server, 'GET', f'/{server.token}/state')
    assert status == 200 and json.loads(body)['lines'] == ['Next: half a turn.']


@pytest.mark.parametrize(('photo', 'words'), [
    (b'<html>no photo</html>', 'expected JPEG or PNG'), (b'', 'expected JPEG or PNG'),
    (b'\xff\xd8\xff\xe0 no more', 'expected JPEG or PNG'),
    (b'\0\0\0\x18ftypheic' + bytes(40), 'HEIC photos cannot be read'),
    (b'\0\0\0\x18ftypmp42' + bytes(40), 'expected JPEG or PNG')])
def test_what_is_no_photo_is_refused_by_its_content(server, folder, photo, words):
    status, told = send(server, photo, headers={'Content-Type': 'image/jpeg'}.items())
    assert status == 415 and words in told['verdict'] and '\n' not in told['verdict']
    assert not list(folder.iterdir())


def test_images_of_other_formats_are_refused(tmp_path):
    assert refusal(encoded('GIF', tmp_path)) == refusal(encoded('TIFF', tmp_path)) != ''
    assert 'at most 200 megapixels' in refusal(encoded('PNG', tmp_path, (20_000, 10_001)))
    assert refusal(encoded('JPEG', tmp_path)) == refusal(encoded('PNG', tmp_path)) == ''


def test_what_is_too_large_is_refused_before_it_is_read(server, folder):
    with socket.create_connection(server.server_address, timeout=10) as client:
        client.sendall(f'POST /{server.token}/photo HTTP/1.1\r\nHost: x\r\nContent-Length: '
                       f'{LARGEST_UPLOAD + 1}\r\n\r\n'.encode())
        assert b' 413 ' in client.recv(4096).split(b'\r\n')[0]
    assert not list(folder.iterdir())


@pytest.mark.parametrize(('length', 'status'), [
    ('', b' 411 '), ('Content-Length: -1\r\n', b' 411 '), ('Content-Length: x\r\n', b' 411 '),
    ('Transfer-Encoding: chunked\r\n', b' 411 '), ('Content-Length: ' + '9' * 400 + '\r\n',
                                                   b' 413 ')])
def test_a_length_that_cannot_be_trusted_is_refused(server, folder, length, status):
    with socket.create_connection(server.server_address, timeout=10) as client:
        client.sendall(f'POST /{server.token}/photo HTTP/1.1\r\nHost: x\r\n{length}\r\n'.encode())
        assert status in client.recv(4096).split(b'\r\n')[0]
    assert not list(folder.iterdir())


def test_a_photo_that_is_cut_off_is_not_kept(server, folder):
    photo = encoded('PNG', folder)
    with socket.create_connection(server.server_address, timeout=10) as client:
        client.sendall(f'POST /{server.token}/photo HTTP/1.1\r\nHost: x\r\nContent-Length: '
                       f'{len(photo) + 5}\r\n\r\n'.encode() + photo)
        client.shutdown(socket.SHUT_WR)
        assert b' 400 ' in client.recv(4096).split(b'\r\n')[0]
    assert not list(folder.iterdir())


def send_together(server, photo, times):
    threads = [threading.Thread(target=send, args=(server, photo)) for _ in range(times)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def test_photos_that_come_together_are_all_kept(server, folder):
    photo = encoded('PNG', folder)
    send_together(server, photo, 4)
    assert len(list(folder.iterdir())) == 4


def test_who_sends_a_large_photo_while_others_are_in_work_is_told_to_try_again(server, folder):
    for _ in range(4):
        assert server.open_uploads.acquire(blocking=False)
    status, told = send(server, bytes(20_000_000))
    assert status == 503 and told['verdict'] == 'Busy with other photos: try again'
    assert not list(folder.iterdir())


def test_of_photos_that_come_together_one_at_a_time_is_decoded(server, folder, monkeypatch):
    opened, inside, most = room.opened, [], []

    @contextmanager
    def counted(*rest):
        with opened(*rest) as image:
            inside.append(image)
            most.append(len(inside))
            time.sleep(0.05)
            yield image
            inside.pop()

    monkeypatch.setattr(room, 'opened', counted)
    photo = encoded('JPEG', folder)
    send_together(server, photo, 3)
    assert most == [1, 1, 1]


@pytest.mark.parametrize(('address', 'served'), [
    ('127.0.0.1', True), ('192.168.1.7', True), ('10.3.4.5', True), ('8.8.8.8', False),
    ('172.15.0.1', False)])
def test_only_clients_of_a_private_network_are_answered(server, address, served):
    assert server.verify_request(None, (address, 1234)) is served


def test_clients_without_end_take_neither_all_threads_nor_the_place_of_others(
        server, monkeypatch):
    monkeypatch.setattr(server, '_connections', threading.BoundedSemaphore(3))
    clients = [socket.create_connection(server.server_address, timeout=2) for _ in range(4)]
    with clients.pop() as last:
        assert last.recv(1) == b''  # left, as one too many
    for client in clients:
        client.close()
    for _ in range(100):
        with suppress(ConnectionError):
            assert ask(server, 'GET', f'/{server.token}/state')[0] == 200
            return
        time.sleep(0.02)  # until the others are found to have gone
    pytest.fail('no room for another')


def test_the_local_network_is_never_all_networks():
    try:
        found = ipaddress.ip_address(lan_address())
    except ConfigError as error:
        assert str(error).startswith('--lan: no local network')
    else:
        assert found.is_private and not found.is_loopback and not found.is_unspecified


def test_the_network_is_not_asked_for_the_name_of_the_address(folder, verdicts, monkeypatch):
    monkeypatch.setattr(socket, 'getfqdn', lambda _: pytest.fail('asks a name server'))
    UploadServer(folder, Progress, verdicts).close()


def test_an_address_that_is_not_this_machine_s_is_refused(folder, verdicts):
    with pytest.raises(ConfigError, match='upload page: cannot be served at 192.0.2.1'):
        UploadServer(folder, Progress, verdicts, '192.0.2.1')


@pytest.mark.parametrize('kind', ['JPEG', 'PNG'])
def test_a_file_that_is_cut_off_is_not_kept(kind, server, folder, tmp_path):
    path = tmp_path / 'whole'
    noise = np.random.default_rng(0).integers(0, 256, (90, 120, 3), np.uint8)
    Image.fromarray(noise).save(path, kind)
    whole = path.read_bytes()
    assert refusal(whole) == ''
    for share in (0.2, 0.6, 0.95):
        status, said = send(server, whole[:int(share * len(whole))])
        assert status == 415 and 'expected JPEG or PNG, whole' in said['verdict']
    assert not any(folder.iterdir())


def test_a_photo_s_name_is_not_given_to_another(server, folder, verdicts, tmp_path):
    photo = encoded('PNG', tmp_path)
    first = server.keep(photo, '.png')
    verdicts.put(first, f'{first}: no board seen in it')
    (folder / first).unlink()  # by who sees that it is no use
    _, said = send(server, photo)
    assert 'no board' not in said['verdict']


@pytest.mark.parametrize('length', ['0' * 20 + '1' + '0' * 12, '9' * 5000])
def test_a_length_is_read_whatever_it_begins_with(length, server):
    with socket.create_connection(server.server_address, timeout=10) as client:
        client.sendall(f'POST /{server.token}/photo HTTP/1.1\r\nHost: it\r\nContent-Length: '
                       f'{length}\r\n\r\n'.encode())
        assert b' 413 ' in client.recv(4096).splitlines()[0]
