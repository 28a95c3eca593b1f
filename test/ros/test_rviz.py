"""The RViz configuration: it listens to what the loop publishes, as the loop publishes it."""

from pathlib import Path

from active_recon.geometry.cameras import OBJECT_FRAME
from active_recon.parameters.recorder import TOPICS
import pytest
import yaml

_PATH = Path(__file__).parents[2] / 'rviz' / 'active_recon.rviz'
CONFIG = yaml.safe_load(_PATH.read_text())['Visualization Manager']
DISPLAYED = {display['Name']: display['Topic'] for display in CONFIG['Displays']
             if 'Topic' in display}
STREAMED = {'/camera/image_raw', '/camera/pose'}


def test_all_that_rviz_hears_is_published_by_the_loop():
    not_recorded = 'mesh', 'views'
    published = {'/' + name.lstrip('/') for name in (*TOPICS, *not_recorded)}
    assert {topic['Value'] for topic in DISPLAYED.values()} <= published
    assert {'/occupancy', '/probabilities', '/view', '/views', '/next_view', '/azimuth_scores',
            '/camera/image_raw', '/mesh'} <= {topic['Value'] for topic in DISPLAYED.values()}


@pytest.mark.parametrize('name', DISPLAYED)
def test_rviz_finds_what_is_latched_and_asks_a_stream_for_no_more_than_it_has(name):
    topic = DISPLAYED[name]
    streamed = topic['Value'] in STREAMED
    assert topic['Durability Policy'] == ('Volatile' if streamed else 'Transient Local')
    assert topic['Reliability Policy'] == ('Best Effort' if streamed else 'Reliable')


def test_boxes_are_as_wide_as_the_cells_of_the_default_network():
    boxes = [display['Size (m)'] for display in CONFIG['Displays']
             if display.get('Style') == 'Boxes']
    assert len(boxes) == 2
    assert all(0.9 / 64 < size <= 1 / 64 for size in boxes)


def test_rviz_stands_in_the_objects_frame_and_needs_no_other():
    assert CONFIG['Global Options']['Fixed Frame'] == OBJECT_FRAME
    assert not [display for display in CONFIG['Displays'] if display['Class'].endswith('/TF')]
