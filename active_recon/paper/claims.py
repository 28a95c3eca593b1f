"""Verdicts on claims, decided by the 95 % intervals of paired differences."""

from collections.abc import Mapping, Sequence

from active_recon.evaluation.statistics import headroom_sentence, Interval, SMALL_HEADROOM
from active_recon.paper.results import Claim, format_interval

HOLDS, FAILS, OPEN = 'holds here', 'does not hold here', 'is left open here'


def larger(claim: str, difference: Interval, what: str, least: float = 0.0) -> Claim:
    """
    Decide a claim that a difference is above `least`.

    It holds if the whole 95 % interval is above, fails if none of it is, and is open otherwise.
    `what` names the difference.
    """
    beyond = '0' if least == 0 else f'{least:g}'
    because = f'{_capital(what)}: {format_interval(difference, 4)}'
    if difference.low > least:
        return Claim(claim, HOLDS, f'{because}, above {beyond}.')
    if difference.high <= least:
        return Claim(claim, FAILS, f'{because}, not above {beyond}.')
    return Claim(claim, OPEN, f'{because}, which has {beyond} inside.')


def smaller(claim: str, difference: Interval, what: str) -> Claim:
    """Decide a claim that a difference is below 0, as `larger` does."""
    because = f'{_capital(what)}: {format_interval(difference, 4)}'
    if difference.high < 0:
        return Claim(claim, HOLDS, f'{because}, below 0.')
    if difference.low >= 0:
        return Claim(claim, FAILS, f'{because}, not below 0.')
    return Claim(claim, OPEN, f'{because}, which has 0 inside.')


def all_larger(claim: str, differences: Mapping[str, Interval], what: str) -> Claim:
    """
    Decide a claim that every difference is above 0, naming those that are not.

    It holds if all intervals are above 0, fails if one is below, and is open if one contains 0
    and none is below.
    """
    behind = {name: value for name, value in differences.items() if value.high <= 0}
    unclear = {name: value for name, value in differences.items()
               if value.low <= 0 < value.high}
    if not behind and not unclear:
        least = min(differences, key=lambda name: differences[name].low)
        return Claim(claim, HOLDS, f'{_capital(what)}: all of {len(differences)} are above 0, the '
                                   f'least sure at {least}: '
                                   f'{format_interval(differences[least], 4)}.')
    parts = [f'{title} at {_listed(part)}' for title, part in (
        ('not above 0', behind), ('0 lies inside', unclear)) if part]
    return Claim(claim, FAILS if behind else OPEN, f'{_capital(what)}: {"; ".join(parts)}.')


def reaches(claim: str, value: Interval, aim: float) -> Claim:
    """Decide by its mean whether a value reaches a target `aim`."""
    reached = value.mean >= aim
    lack = '' if reached else f', missed by {aim - value.mean:.3f}'
    return Claim(claim, HOLDS if reached else FAILS,
                 f'Measured {format_interval(value)}, the aim is {aim:g}{lack}.')


def headroom(difference: Interval) -> Claim:
    """Decide whether view policies have headroom: the greedy oracle minus random."""
    matters = difference.mean >= SMALL_HEADROOM
    verdict = HOLDS if matters and difference.low > 0 else OPEN if matters else FAILS
    return Claim('Choosing views can gain something', verdict, headroom_sentence(difference))


def best(claim: str, wanted: str, gaps: Mapping[str, Interval], what: str) -> Claim:
    """
    Decide a claim that `wanted` is the best of several.

    `gaps` are the paired differences of `wanted` minus each of the others.
    """
    ahead = [name for name, gap in gaps.items() if gap.mean < 0]
    surely = {name: gap for name, gap in gaps.items() if gap.high < 0}
    if surely:
        return Claim(claim, FAILS, f'{_capital(what)}: {wanted} is behind {_listed(surely)}.')
    if all(gap.low > 0 for gap in gaps.values()):
        return Claim(claim, HOLDS, f'{_capital(what)}: {wanted} is ahead of every other.')
    first = 'has the highest mean' if not ahead else f'has a lower mean than {", ".join(ahead)}'
    return Claim(claim, OPEN, f'{_capital(what)}: {wanted} {first}, but intervals have 0 inside: '
                 f'{_listed({name: gap for name, gap in gaps.items() if gap.low <= 0})}.')


def _listed(values: Mapping[str, Interval]) -> str:
    return ', '.join(f'{name} ({format_interval(value, 4)})' for name, value in values.items())


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def sentences(claims: Sequence[Claim]) -> str:
    """Return the claims as a list in Markdown."""
    return '\n'.join(claim.markdown() for claim in claims)
