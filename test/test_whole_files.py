"""A file is written whole, or what stood in its place stays."""

import os
import signal

from active_recon.errors import ConfigError
from active_recon.interrupts import forget_interrupt, interrupt
from active_recon.whole_files import unfinished_folder, whole_file, writable
from command_line import refusal
import pytest


@pytest.mark.parametrize('before', [None, 'before'])
def test_what_was_written_takes_the_place_once_it_is_whole(tmp_path, before):
    path = tmp_path / 'it.json'
    if before is not None:
        path.write_text(before)
    with whole_file(path) as unfinished:
        unfinished.write_text('after')
        assert path.exists() == (before is not None)
    assert path.read_text() == 'after'
    assert list(tmp_path.iterdir()) == [path]


def test_of_two_that_write_at_once_each_writes_the_whole_and_the_last_stays(tmp_path):
    path = tmp_path / 'it.json'
    with whole_file(path) as first, whole_file(path) as second:
        first.write_text('first')
        second.write_text('second')
    assert path.read_text() == 'first'  # the inner block ended before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize('error', [OSError, KeyboardInterrupt])
@pytest.mark.parametrize('text', [None, 'half of it'])
def test_what_fails_leaves_what_stood_there_and_nothing_beside_it(tmp_path, error, text):
    path = tmp_path / 'it.json'
    path.write_text('before')
    with pytest.raises(error), whole_file(path) as unfinished:
        if text is not None:
            unfinished.write_text(text)
        raise error
    assert path.read_text() == 'before'
    assert list(tmp_path.iterdir()) == [path]


def test_a_disk_without_room_is_told_with_the_name_of_the_file(tmp_path):
    path = tmp_path / 'it.json'
    with pytest.raises(OSError, match=f'No space left on device: {str(path)!r}'), (
            whole_file(path)), open('/dev/full', 'w') as full:
        full.write('what has no room')


def test_a_folder_that_is_gone_is_told_with_the_name_of_the_file_that_was_to_be_in_it(tmp_path):
    path = tmp_path / 'gone' / 'it.json'
    with pytest.raises(FileNotFoundError, match=f'{str(path)!r}$'), whole_file(path) as unfinished:
        unfinished.write_text('what has no place')


def test_a_library_s_own_words_stay(tmp_path):
    with pytest.raises(OSError, match='^no such mode$'), whole_file(tmp_path / 'picture.png'):
        raise OSError('no such mode')


def test_the_folder_of_a_file_is_made_and_nothing_in_it(tmp_path):
    path = tmp_path / 'new' / 'it.json'
    assert writable(path) == path
    assert list(tmp_path.rglob('*')) == [path.parent]


def test_a_folder_at_the_place_of_a_file_or_a_file_at_that_of_its_folder_is_refused(tmp_path):
    (tmp_path / 'file').touch()
    for path in (tmp_path, tmp_path / 'file' / 'it.json'):
        with pytest.raises(ConfigError, match='cannot be written: expected a f'):
            writable(path)


@pytest.mark.parametrize('asked', [
    ('evaluate', 'data', '--json', 'file/it.json'), ('evaluate', 'data', '--rows', 'file/it.csv'),
    ('study', 'data', '--out', 'file'), ('policies', 'data', '--out', 'file'),
    ('paper', 'table1', '--out', 'file'), ('quality', 'measure', 'data', 'file/it.npz'),
    ('train-depth', 'data', '--validation', 'data', '--out', 'file'),
    ('train-segmenter', 'data', '--validation', 'data', '--out', 'file')], ids=' '.join)
def test_what_cannot_be_written_is_told_before_the_work(
        asked, dataset, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'file').touch()
    (tmp_path / 'data').symlink_to(dataset)
    assert 'cannot be written' in refusal(monkeypatch, capsys, *asked)


@pytest.mark.parametrize('asked', [
    ('study', 'data', '--counts', 'two'), ('study', 'data', '--models', 'carving,carving'),
    ('study', 'data', '--models', 'carving', '--validation', 'data'),
    ('policies', 'data', '--policies', 'luck'), ('policies', 'data', '--policies', 'sequence'),
    ('quality', 'study', 'none.npz')], ids=' '.join)
def test_a_study_whose_options_are_refused_makes_no_folder(asked, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    refusal(monkeypatch, capsys, *asked, '--out', 'new')
    assert not list(tmp_path.iterdir())


def test_a_command_stopped_while_it_makes_a_folder_leaves_none(monkeypatch, tmp_path):
    make = os.mkdir

    def make_and_be_stopped(*args, **kwargs):
        make(*args, **kwargs)
        os.kill(os.getpid(), signal.SIGTERM)

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        monkeypatch.setattr(os, 'mkdir', make_and_be_stopped)
        with pytest.raises(KeyboardInterrupt), unfinished_folder(tmp_path):
            pytest.fail('the block ran')
    finally:
        signal.signal(signal.SIGTERM, before)
        forget_interrupt()
    assert not list(tmp_path.iterdir())
