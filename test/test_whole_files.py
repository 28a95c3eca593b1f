"""A file is written whole, or what stood in its place stays."""

from active_recon.whole_files import whole_file
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
