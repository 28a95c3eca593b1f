"""The documents as their readers see them."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob('*.md'), *(ROOT / 'doc').glob('*.md'),
                *(ROOT / 'docs').rglob('*.md')])


@pytest.mark.parametrize('page', PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_line_is_left_out_as_a_comment(page):
    outside_of_code = re.sub(r'^```.*?^```', '', page.read_text(), flags=re.DOTALL | re.MULTILINE)
    assert not re.findall(r'^ *%.*', outside_of_code, re.MULTILINE)  # a comment in MyST
