"""The page of an archive in a real browser."""

from active_recon.batch.rows import refusal_row
from active_recon.batch.summary import Summary
import pytest

pytestmark = pytest.mark.browser


def test_the_charts_are_drawn_without_complaint(chromium, tmp_path):
    summary = Summary()
    rows = [refusal_row(f'{number}.mcap', 'damaged', kind)
            for number, kind in enumerate(('data', 'data', 'version'))]
    assert list(summary.counting(rows)) == rows
    summary.write(tmp_path / 'page.html', 'measure')
    chromium.open((tmp_path / 'page.html').as_uri())
    bars = 'return document.querySelectorAll("[data-chart] .bars path").length'
    assert chromium.until(lambda: chromium.run(bars), 'the chart') == 2
    assert chromium.errors() == []
