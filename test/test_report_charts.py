"""Figures: Plotly knows every word of them, and they draw what is known and no more."""

from dataclasses import replace
from itertools import islice

from active_recon.report.charts import entropy_chart, iou_chart, stage_chart, view_color
from active_recon.report.page import MAX_SUBJECTS
from active_recon.report.stages import STAGES, timings
from active_recon.report.subject import letters, Subject
from active_recon.report.truth import known_truth
from active_recon.report.turntable_map import turntable_map
import plotly.graph_objects as go
import pytest
from report_runs import changed, recorded_run


@pytest.fixture(scope='module')
def subject():
    run = recorded_run('chair', 'uniform', 3)
    return Subject('A', run, run.episodes[0], known_truth(run).cells)


def in_plain_colors(value):
    if isinstance(value, dict):
        return {key: in_plain_colors(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [in_plain_colors(inner) for inner in value]
    return '#123456' if isinstance(value, str) and value.startswith('--') else value


@pytest.mark.parametrize('draw', [
    turntable_map, lambda subject: entropy_chart([subject]), lambda subject: iou_chart([subject]),
    lambda subject: iou_chart([subject, subject]),
    lambda subject: stage_chart(timings(subject.episode))])
def test_plotly_knows_the_figure(subject, draw):
    go.Figure(in_plain_colors(draw(subject)))  # raises where a name or a value is not Plotly's


def test_curves_are_what_was_recorded_and_have_holes_where_nothing_was(subject):
    first, *rest = subject.views
    run = changed(subject.run, views=[replace(first, entropy=None), *rest])
    [curve] = entropy_chart([Subject('A', run, run.episodes[0])])['data']
    assert curve['y'] == [None, *(view.entropy for view in rest)]
    [curve] = iou_chart([subject])['data']
    assert curve['y'] == subject.ious
    assert all(0 < value < 1 for value in curve['y'])


def test_one_view_alone_is_drawn_on_an_axis_that_can_be_read(subject):
    run = changed(subject.run, views=subject.views[:1])
    for draw in (entropy_chart, iou_chart):
        alone = draw([Subject('A', run, run.episodes[0], subject.truth)])['layout']['yaxis']
        several = draw([subject])['layout']['yaxis']
        assert (alone['rangemode'], several.get('rangemode')) == ('tozero', None)


def test_runs_side_by_side_have_a_curve_each_under_their_letter(subject):
    other = replace(subject, letter='B')
    curves = entropy_chart([subject, other])['data']
    assert [curve['name'] for curve in curves] == ['A', 'B']
    assert curves[0]['line']['color'] != curves[1]['line']['color']


@pytest.mark.parametrize('draw', [entropy_chart, iou_chart])
def test_curves_of_as_many_runs_as_a_page_takes_differ_in_more_than_colour(subject, draw):
    runs = [replace(subject, letter=letter) for letter in islice(letters(), MAX_SUBJECTS)]
    curves = draw(runs)['data']
    assert len({curve['marker']['symbol'] for curve in curves}) == MAX_SUBJECTS
    for run, curve in zip(runs, curves, strict=True):
        assert curve['hovertemplate'].startswith(f'{run.letter}, after view')
    assert draw([subject])['data'][0]['hovertemplate'].startswith('after view')


def test_bars_of_a_view_are_its_stages(subject):
    bars = stage_chart(timings(subject.episode))['data']
    assert [bar['name'] for bar in bars] == [stage.name for stage in STAGES]
    for index, timing in enumerate(timings(subject.episode)):
        assert tuple(bar['x'][index] for bar in bars) == timing.stages


def test_neighbouring_views_differ_in_colour():
    assert all(view_color(number) != view_color(number + 1) for number in range(1, 24))
