"""The notebook and the tutorial on photos do what they show."""

import json
from pathlib import Path
import re

from active_recon.cli.main import app
from photo_scene import cameras, on_plain, rendered, write_photos
from PIL import Image
import pytest
import trimesh
import typer

pytestmark = pytest.mark.usefixtures('loaded_once')
ROOT = Path(__file__).parents[1]
TUTORIAL = ROOT / 'doc/photos.md'
WATCHING = ROOT / 'doc/watching.md'
NOTEBOOK = ROOT / 'examples/photos.ipynb'


def test_the_notebook_makes_its_photos_and_a_mesh_of_them(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {}
    for cell in json.loads(NOTEBOOK.read_text())['cells']:
        if cell['cell_type'] == 'code':
            exec(''.join(cell['source']), names)
    said = capsys.readouterr().out
    assert 'expected IoU' in said and "network's own silhouettes" in said
    assert 0.85 < trimesh.load('chair.ply').extents.max() < 0.91  # the chair fills its cube
    with Image.open('chair.png') as picture:
        assert picture.width > 1000
    assert not names['shape'].left_out


def test_the_tutorial_s_python_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    views = cameras(3)
    write_photos(tmp_path / 'photos', views, map(on_plain, rendered(views)))
    names = {}
    for code in re.findall(r'^```python\n(.*?)^```', TUTORIAL.read_text(), re.M | re.S):
        exec(code, names)
    assert 'expected IoU' in capsys.readouterr().out
    assert Path('mug.ply').stat().st_size > 1000
    assert names['same'].size == names['shape'].size == 0.2


def test_the_tutorial_names_every_option_of_the_command():
    command = typer.main.get_command(app).commands['reconstruct']
    text = TUTORIAL.read_text() + WATCHING.read_text()
    board = {'--marker-mm', '--dictionary', '--squares', '--square-mm'}  # those of calibrate
    missing = [option for each in command.params for option in each.opts
               if option.startswith('--') and option not in text and option not in board
               and option not in ('--help', '--views', '--model')]
    assert not missing
