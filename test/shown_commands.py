"""The command lines that the pages show, to be copied into a shell."""

from pathlib import Path
import re
import shlex

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob('*.md'), *ROOT.glob('doc/*.md'), *ROOT.glob('bags/**/README.md'),
         ROOT / 'security/README.md']
_FENCED = re.compile(r'^ *```[^\n]*\n(.*?)^ *```', re.MULTILINE | re.DOTALL)
_TEXT = '\n'.join(page.read_text() for page in PAGES).replace('\\\n', '')
_PROSE = _FENCED.sub('', _TEXT)
LINES = [*'\n'.join(_FENCED.findall(_TEXT)).splitlines(),
         *re.findall('^    .+', _PROSE, re.MULTILINE)]
SPANS = re.findall(r'`([^`]+)`', _PROSE)


def words_after(program, texts):
    """Return the words that follow a program's name in each of the texts that begin with it."""
    start = re.compile(rf'\s*(?:\.venv/bin/)?{program}\s+')
    found = [shlex.split(text[called.end():], comments=True) for text in texts
             if (called := start.match(text))]
    return [[word for word in words if word != '...'] for words in found]  # more of the same
