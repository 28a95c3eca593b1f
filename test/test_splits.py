"""ShapeNet as people have it: its categories' names, published splits and the sorted one."""

import json
import shutil

from active_recon.datasets.layout import list_objects
from active_recon.datasets.splits import list_split, SYNSETS
from active_recon.datasets.views import read_views
from active_recon.errors import ConfigError, DataError
from active_recon.shapes import CATEGORIES
import pytest

CHAIR, CAR = '03001627', '02958343'


@pytest.fixture
def root(tmp_path):
    """Return a download of ten chairs and five cars, the images' folders alone."""
    for synset, count in ((CHAIR, 10), (CAR, 5)):
        for index in range(count):
            (tmp_path / f'ShapeNetRendering/{synset}/{index:x}a/rendering').mkdir(parents=True)
    return tmp_path


def write(root, content):
    path = root / 'ShapeNet.json'
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def names(folders):
    return [f'{folder.category}/{folder.name}' for folder in folders]


def record(synset, name='?', **parts):
    return {'taxonomy_id': synset, 'taxonomy_name': name, 'baseline': {'1-view': 0.5},
            'train': [], 'val': [], 'test': [], **parts}


def test_the_thirteen_synsets_bear_the_names_of_our_categories():
    assert sorted(SYNSETS.values()) == sorted(CATEGORIES)


def test_a_published_split_names_the_objects_of_each_part(root):
    path = write(root, [record(CHAIR, 'chair', train=['0a', '3a'], test=['2a']),
                        record(CAR, 'car', test=['4a', '1a'])])
    assert names(list_split(root, path, 'train')[0]) == [f'{CHAIR}/0a', f'{CHAIR}/3a']
    found, missing = list_split(root, path, 'test')
    assert names(found) == [f'{CHAIR}/2a', f'{CAR}/4a', f'{CAR}/1a']
    assert missing == []


def test_several_records_of_a_category_all_count_and_each_object_once(root):
    path = write(root, [record(CHAIR, train=['0a', '3a']), record(CAR, train=['1a', '1a']),
                        record(CHAIR, train=['2a', '3a'])])
    assert names(list_split(root, path, 'train')[0]) == [
        f'{CHAIR}/0a', f'{CHAIR}/3a', f'{CAR}/1a', f'{CHAIR}/2a']


def test_a_split_by_synset_is_read_like_a_list_of_records(root):
    records = [record(CHAIR, test=['2a']), record(CAR, test=['4a'])]
    listed = list_split(root, write(root, records), 'test')
    by_synset = {entry.pop('taxonomy_id'): entry for entry in records}
    assert list_split(root, write(root, by_synset), 'test') == listed
    kept = {CHAIR: record(CHAIR, test=['2a']), CAR: record(CAR, test=['4a'])}
    assert list_split(root, write(root, kept), 'test') == listed


def test_what_the_split_names_and_the_disk_lacks_is_told_one_by_one(root):
    path = write(root, [record(CHAIR, test=['2a', 'ffff']), record('02691156', test=['1a'])])
    found, missing = list_split(root, path, 'test')
    assert names(found) == [f'{CHAIR}/2a']
    assert missing == [f'{root}: no such folder: expected {CHAIR}/ffff of test',
                       f'{root}: no such folder: expected 02691156/1a of test']


def test_a_split_of_which_nothing_is_there_is_refused(root):
    path = write(root, [record(CHAIR, test=['eeee', 'ffff'])])
    with pytest.raises(DataError, match="none of the split's objects: expected the 2 objects .*; "
                       'are its folders'):
        list_split(root, path, 'test')
    with pytest.raises(DataError, match='the 0 objects'):
        list_split(root, path, 'val')


def test_the_last_fifth_of_the_sorted_ids_is_tested_on_as_in_r2n2_s_own_code(root):
    found, missing = list_split(root, 'sorted', 'test')
    assert names(found) == [f'{CAR}/4a', f'{CHAIR}/8a', f'{CHAIR}/9a']
    assert missing == []


def test_the_sorted_parts_share_nothing_and_leave_nothing_out(root):
    parts = [names(list_split(root, 'sorted', part)[0]) for part in ('train', 'val', 'test')]
    assert list(map(len, parts)) == [7 + 3, 1 + 1, 2 + 1]
    assert sorted(sum(parts, [])) == names(list_objects(root))


def test_another_part_is_refused(root):
    with pytest.raises(ConfigError, match="part: no such part: expected one of train, val, test, "
                       "got 'tests'"):
        list_split(root, 'sorted', 'tests')


@pytest.mark.parametrize('content', [
    '', '{', '[]', '3', '[3]', '{"03001627": 3}', '[{"taxonomy_id": "03001627"}]',
    '[{"taxonomy_id": 3, "test": []}]', '[{"taxonomy_id": "03001627", "test": [3]}]',
    '[{"taxonomy_id": "03001627", "test": "2a"}]', '\x00'])
def test_a_file_that_is_no_split_is_refused_with_its_path(content, root):
    with pytest.raises(DataError, match=r'ShapeNet\.json: (no readable split file: expected JSON|'
                       r'invalid split: expected a record|'
                       r'invalid record: expected a taxonomy_id)'):
        list_split(root, write(root, content), 'test')


def test_a_missing_split_or_dataset_is_refused(root, tmp_path):
    with pytest.raises(DataError, match=r'none\.json: no readable split file: expected JSON.*No '
                       r'such file'):
        list_split(root, root / 'none.json', 'test')
    with pytest.raises(DataError, match='has no folder ShapeNetRendering'):
        list_split(tmp_path / 'none', 'sorted', 'test')


def test_a_synset_s_folder_is_of_the_category_that_it_names(dataset, tmp_path):
    for top in ('ShapeNetRendering', 'ShapeNetVox32'):
        shutil.copytree(dataset / top / 'table', tmp_path / top / '04379243')
    views = read_views(list_objects(tmp_path))
    assert list(views.categories) == ['table'] * 3
