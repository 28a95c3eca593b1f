"""What a bag holds, and whether it can be replayed."""

from dataclasses import dataclass
from pathlib import Path

from active_recon.bags.raw import BagSummary
from active_recon.bags.reading import run_in
from active_recon.bags.run import RecordedRun
from active_recon.bags.storage import open_bag
from active_recon.bags.topics import Topics
from active_recon.errors import ActiveReconError
from active_recon.reporting import Reporting, silent


@dataclass(frozen=True)
class BagDescription:
    """A bag's contents; the run in it, or None and what is `missing` for one."""

    summary: BagSummary
    run: RecordedRun | None
    missing: str


def describe_bag(path: Path, topics: Topics, reporting: Reporting = silent) -> BagDescription:
    """Describe a bag; raises DataError where it is none, or a damaged one."""
    bag = open_bag(path)
    summary = bag.summary(reporting)
    try:
        return BagDescription(summary, run_in(bag, summary, path, topics, reporting), '')
    except ActiveReconError as error:
        return BagDescription(summary, None, str(error).removeprefix(f'{path}: '))
