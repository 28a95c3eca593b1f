"""What the study of view policies says of how they came about."""

import json

from active_recon.paper.policies import learned_from
from paper_study import untrained
import pytest


@pytest.fixture
def trained_on(tiny, tmp_path):
    """Return what writes weights whose card names the folders that they learned from."""
    def write(*folders):
        path = untrained(tmp_path / '-'.join(folders), tiny, 0)
        card = path.with_suffix('.json')
        told = json.loads(card.read_text()) | {'data': dict.fromkeys(folders, 1)}
        card.write_text(json.dumps(told))
        return path
    return write


def test_policies_that_learned_alike_need_no_word(trained_on):
    assert learned_from([trained_on('train')]) == ''
    assert learned_from([trained_on('train'), trained_on('train')]) == ''


def test_the_study_says_where_its_policies_learned_from_different_objects(trained_on):
    paths = [trained_on('train', 'real_train'), trained_on('train'), trained_on('train')]
    assert learned_from(paths) == ' (the first on train and real_train, others on train)'
