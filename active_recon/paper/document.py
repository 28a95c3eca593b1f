"""`docs/results/README.md`: all parts in reading order, and what follows from them."""

from collections.abc import Sequence

from active_recon.errors import DataError
from active_recon.paper.claims import FAILS, HOLDS, OPEN, sentences
from active_recon.paper.parts import PARTS
from active_recon.paper.results import Claim, PUBLISHED
from active_recon.paper.study import Study
from active_recon.paper.writing import body, claims_of, read_result
from active_recon.whole_files import whole_file

_INTRODUCTION = f"""\
# The paper's tables and figures, measured here

"Object Reconstruction Based on Attentive Recurrent Network from Single and Multiple Images". All
figures are of this repository's own objects. Columns headed "{PUBLISHED}" hold what the paper
printed, of the dataset that they name: of other objects, of networks whose sizes it does not
state, and so not to be compared with the figures beside them. Brackets are 95 % intervals.
Whether a claim holds is decided by the program from the intervals of paired differences. The
hashes of data and weights stand in full in each part's JSON."""


def write_document(study: Study) -> bool:
    """
    Write README.md with all results there are; return whether it changed.

    Raises DataError where there is no result, or one that cannot be read.
    """
    there = {name: read_result(study, name) for name in PARTS
             if (study.out / f'{name}.json').is_file()}
    if not there:
        raise DataError(f'{study.out}: no results: expected at least one part, found none; '
                        '`active-recon paper all` makes them')
    blocks = [_INTRODUCTION, '## What holds, and what does not']
    claims = {name: claims_of(found) for name, found in there.items()}
    for verdict in (FAILS, OPEN, HOLDS):
        blocks += _verdict(verdict, claims)
    for name, found in there.items():
        blocks += [f'#{body(study, name)}', f'Command: `{found["command"]}`; '
                                            f'[in full]({name}.json).']
    if missing := [name for name in PARTS if name not in there]:
        blocks += ['## Not measured yet',
                   '\n'.join(f'- `{study.command(name)}`' for name in missing)]
    text = '\n\n'.join(blocks) + '\n'
    path = study.out / 'README.md'
    if path.is_file() and path.read_text() == text:
        return False
    with whole_file(path) as unfinished:
        unfinished.write_text(text)
    return True


def _verdict(verdict: str, claims: dict[str, list[Claim]]) -> list[str]:
    """Return a heading and the claims with one verdict, each with a link to its part."""
    verdicts: Sequence[Claim] = [
        Claim(f'{claim.claim} ([{name}]({name}.md))', claim.verdict, claim.because)
        for name, own in claims.items() for claim in own if claim.verdict == verdict]
    return [f'### What {verdict}', sentences(verdicts)] if verdicts else []
