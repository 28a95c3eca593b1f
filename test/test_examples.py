"""What users are shown to copy is Python that compiles."""

from pathlib import Path
import re

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = {path.name: path.read_text() for path in sorted((ROOT / 'examples').glob('*.py'))}
SNIPPETS = dict(enumerate(re.findall(
    r'^```python\n(.*?)^```', (ROOT / 'README.md').read_text(), re.MULTILINE | re.DOTALL)))


@pytest.mark.parametrize('name', [*EXAMPLES, *SNIPPETS])
def test_an_example_compiles(name):
    compile({**EXAMPLES, **SNIPPETS}[name], str(name), 'exec')


def test_the_readme_names_every_example():
    text = (ROOT / 'README.md').read_text()
    assert EXAMPLES
    assert all(f'examples/{name}' in text for name in EXAMPLES)
    assert SNIPPETS
