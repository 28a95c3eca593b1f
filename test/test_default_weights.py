"""`make weights`: everything that belongs to a default network, from nothing, step by step."""

from pathlib import Path
import shutil
import subprocess
import sys

from active_recon.models.depth_weights import load_refiner
from active_recon.models.lifting import SIZES
from active_recon.models.scorer_weights import load_scorer
from active_recon.models.segmenter_weights import is_segmenter
from active_recon.models.weights import load_weights
from active_recon.models.weights_files import weights_hash
import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which('make') is None, reason='needs make'),
]

ROOT = Path(__file__).parent.parent
CHAIRS, THING = '--category chair --train 2 --val 2', '--category thing --train 1 --val 0'
TINY = {
    'AR': f'{sys.executable} -m active_recon.cli.main', 'STEPS': 1, 'DEVICES': 1, 'DEPTH_STEPS': 1,
    'SEGMENTER_STEPS': 1, 'LARGE_STEPS': 1, 'LARGE_BATCH': 2, 'MAKE_PROCESSES': 1,
    'MADE': '--kept 4',
    'PARAMETRIC': CHAIRS, 'TURNTABLE': CHAIRS, 'DOME': CHAIRS, 'DEEP': CHAIRS,
    'THINGS': THING, 'TURNTABLE_THINGS': THING, 'DOME_THINGS': THING, 'DEEP_THINGS': THING,
    'POLICY': '--objects 2 --rounds 1 --starts 1 --views 2 --epochs 1'}


def made(run: Path, goal: str = 'weights', **options: object) -> str:
    """Run weights.mk; return what it printed."""
    asked = [f'{name}={value}' for name, value in {'RUN': run, **TINY, **options}.items()]
    done = subprocess.run(['make', '-f', 'weights.mk', goal, *asked], cwd=ROOT, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=3600)
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    """Return the folder of a whole run whose training was done by a start before."""
    folder = tmp_path_factory.mktemp('run')
    made(folder, f'{folder}/lifting/weights.safetensors')
    said = made(folder)
    assert ' train ' not in said and ' train-policy ' in said
    return folder


def test_all_that_belongs_to_the_network_is_written_beside_it_and_loads(run):
    weights = run / 'weights' / 'lifting.safetensors'
    assert load_weights(weights).reconstruction.resolution == 64
    assert load_scorer(weights).members and load_refiner(weights) is not None
    quality = (run / 'weights' / 'lifting-quality.json').read_text()
    assert weights_hash(weights) in quality
    assert is_segmenter(weights.with_name('segmenter.safetensors'))
    assert {path.name for path in weights.parent.glob('*.onnx')} == {
        'segmenter-segment.onnx',
        *(f'lifting-{graph}.onnx' for graph in ('encode', 'update', 'decode', 'policy', 'depth'))}


def test_a_second_start_makes_nothing_again(run):
    assert 'Nothing to be done' in made(run)


def test_what_was_deleted_is_made_again_with_what_follows_from_it(run):
    (run / 'policy' / 'weights-scorer.safetensors').unlink()
    said = made(run)
    assert ' train-policy ' in said and ' export ' in said and ' train-depth ' not in said


def test_the_large_network_is_trained_on_made_objects_from_the_small_one(run):
    said = made(run, SIZE='large')
    assert ' train --make 1 ' in said and '--widen-to large' in said
    assert 'train-segmenter' not in said
    weights = run / 'weights' / 'lifting-large.safetensors'
    assert load_weights(weights).config == SIZES['large']
    assert load_scorer(weights).members and load_refiner(weights) is not None
    assert weights_hash(weights) in (run / 'weights' / 'lifting-large-quality.json').read_text()
    assert {path.name for path in weights.parent.glob('lifting-large-*.onnx')} == {
        f'lifting-large-{graph}.onnx'
        for graph in ('encode', 'update', 'decode', 'policy', 'depth')}
    assert 'Nothing to be done' in made(run) and 'Nothing to be done' in made(run, SIZE='large')
