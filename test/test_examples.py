"""What users are shown to copy is Python that compiles."""

from pathlib import Path
import re

from active_recon import orbit_camera, Planner
from active_recon.geometry.view_distance import view_distance
import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = {path.name: path.read_text() for path in sorted((ROOT / 'examples').glob('*.py'))}
PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'doc').glob('*.md'))]
PYTHON = re.compile(r'^```python\n(.*?)^```', re.MULTILINE | re.DOTALL)
SNIPPETS = {f'{page.name}-{number}': code for page in PAGES
            for number, code in enumerate(PYTHON.findall(page.read_text()))}


@pytest.mark.parametrize('name', [*EXAMPLES, *SNIPPETS])
def test_an_example_compiles(name):
    compile({**EXAMPLES, **SNIPPETS}[name], str(name), 'exec')


def test_the_readme_names_every_example():
    text = (ROOT / 'README.md').read_text()
    assert EXAMPLES
    assert all(f'examples/{name}' in text for name in EXAMPLES)
    assert SNIPPETS


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_a_page_links_to_files_that_exist(page):
    links = re.findall(r'\]\(([^)#:]+)(?:#[^)]*)?\)', page.read_text())
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_every_page_has_its_place_in_the_index():
    index = (ROOT / 'doc/index.md').read_text()
    listed = {line.strip() for line in index.splitlines()}
    assert {page.stem for page in PAGES if page.parent.name == 'doc'} - {'index'} <= listed


def test_the_documented_policy_asks_for_a_quarter_turn():
    names = {}
    exec(next(code for name, code in SNIPPETS.items() if name.startswith('extending')), names)
    planner = Planner(names['Quarter']())
    decision = planner.add_view(np.zeros((1, 4, 4), np.float32), orbit_camera(0.5), 1.0)
    assert decision.goal is not None
    turn = view_distance(decision.goal.camera, orbit_camera(0.5))
    assert turn == pytest.approx(np.pi / 2, abs=np.radians(8))
