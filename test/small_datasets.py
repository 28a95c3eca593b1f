"""Datasets of a few shapes, rendered in seconds."""

from pathlib import Path

from active_recon.datasets.making import make_dataset, shape_jobs


def lamps_and_tables(out: Path, count: int) -> Path:
    """Make `count` lamps and as many tables in R2N2's layout; return their folder."""
    jobs = [job for category in ('lamp', 'table')
            for job in shape_jobs(category, range(count), out)]
    assert not [outcome.refusal for outcome in make_dataset(jobs, samples=1) if outcome.refusal]
    return out
