"""The seams: a network and a policy of a dozen lines go all the way, by one line each."""

from contextlib import nullcontext
import math

from active_recon.datasets.layout import list_objects
from active_recon.datasets.views import read_views
from active_recon.evaluation.contenders import contenders
from active_recon.evaluation.policy_study import compare, run_all
from active_recon.evaluation.trial import Trial
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models.network import Cameras
from active_recon.models.registry import NETWORKS
from active_recon.models.weights import load_weights, save_weights
from active_recon.planner import Planner
from active_recon.policies import POLICIES
from active_recon.reconstructor import Reconstructor
from active_recon.runtimes.torch import TorchRuntime
from active_recon.training.loop import make_fabric, TrainingConfig
from active_recon.training.plan import Plan, train_plan
from active_recon.volumes.rendering import composite, Renderer
from active_recon.volumes.voxels import iou, turned
import numpy as np
import pytest
from shown_views import part_of
import torch
import toy
import trimesh


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    monkeypatch.setitem(NETWORKS, 'toy', toy.ENTRY)
    monkeypatch.setitem(POLICIES, 'opposite', toy.POLICY)


@pytest.fixture(scope='module')
def seen(dataset):
    """Return the six objects in the size that the toy asks for."""
    return read_views(list_objects(dataset), resolution=32, image_size=48)


@pytest.fixture(scope='module')
def weights(seen, tmp_path_factory):
    """Return weights of the toy that ten steps have trained."""
    folder = tmp_path_factory.mktemp('toy')
    training = TrainingConfig(
        steps=10, batch_size=4, max_views=3, learning_rate=0.1, bfloat16=False, warmup_steps=1)
    torch.manual_seed(0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(NETWORKS, 'toy', toy.ENTRY)
        plan = Plan('toy', 'small', toy.ENTRY.loss, training, None)
        bundle = train_plan(plan, seen, seen, folder,
                            lambda stage, steps: nullcontext(lambda step, told: None),
                            make_fabric(False))
    save_weights(folder / 'toy.safetensors', bundle)
    return folder / 'toy.safetensors'


def test_a_toy_is_trained_like_any_other(weights):
    fresh, learned = toy.Toy(toy.ToyConfig().gain), load_weights(weights)
    assert learned.model == 'toy'
    assert (learned.reconstruction.gain - fresh.gain).abs().min() > 0.01
    assert (weights.parent / 'reconstruction.safetensors').is_file()


@pytest.mark.slow
def test_toys_are_measured_like_any_others(weights, seen):
    bundle = load_weights(weights)
    few = part_of(seen, chosen=slice(None, None, 4))
    trial = Trial(bundle.reconstruction, bundle.threshold, few, starts=2, count=4)
    found = compare(trial, run_all(trial, contenders(['opposite', 'random', 'oracle'], count=4)))
    ious = [value['mean'] for value in found['policies']['opposite']['iou']]
    assert ious[3] > ious[0] + 0.05  # it carves
    assert found['headroom']['mean'] >= 0


def test_a_toy_policy_asks_for_goals_at_any_elevation(weights):
    planner = Planner.load('opposite', max_views=4, entropy_tolerance=0)
    goal = planner.first_goal(orbit_camera(0.4, math.radians(60)))
    latent = np.zeros((1, 4, 4), np.float32)
    second = planner.add_view(latent, goal.camera, 1.0).goal
    assert goal.camera.elevation == second.camera.elevation == math.radians(60)
    assert second.camera.azimuth == pytest.approx(0.4 + math.pi, abs=math.tau / 48)


@pytest.fixture(scope='module')
def pictures():
    """Return images of a black block off the axis, and the cameras they were taken with."""
    block = trimesh.creation.box((0.6, 0.3, 0.4))
    block.apply_translation((0.1, 0.2, -0.1))
    block.visual.face_colors = (0, 0, 0, 255)
    renderer = Renderer(block)
    cameras = [orbit_camera(azimuth, elevation) for azimuth, elevation in (
        (0.0, 0.5), (1.4, 0.1), (2.9, 0.9), (4.6, 0.5))]
    return [(composite(renderer.render(camera), 255), camera) for camera in cameras]


def reconstructed(network, pictures, yaw=0.0, object_yaw=0.0, size=1.0):
    """Return the occupancy after pictures whose cameras were turned by a yaw, (R, R, R)."""
    reconstructor = Reconstructor(TorchRuntime(network), size, object_yaw, 0.5)
    for image, camera in pictures:
        found = reconstructor.add_view(image, camera.turned(yaw).scaled(size))
    return found.grid.occupancy


@pytest.mark.parametrize('turns', [1, 2, 3])
def test_a_network_without_a_front_answers_in_the_frame_of_its_cameras(pictures, turns):
    network = toy.Toy(8.0)
    plain = reconstructed(network, pictures)
    expected = np.rot90(plain, turns, (0, 1))  # from +x to +y
    np.testing.assert_allclose(reconstructed(network, pictures, turns * math.pi / 2), expected,
                               atol=1e-3)
    assert np.abs(plain - expected).max() > 0.1


@pytest.mark.parametrize('yaw', [0.3, 2.0, 5.5])
def test_a_network_without_a_front_is_as_good_at_any_yaw(pictures, yaw):
    network = toy.Toy(8.0)
    found = reconstructed(network, pictures, yaw) > 0.5
    expected = turned(reconstructed(network, pictures), yaw) > 0.5
    assert iou(found, expected) > 0.85  # turned cells are blurred


@pytest.mark.parametrize('yaw', [0.0, 0.3, 2.0])
def test_the_yaw_of_the_front_means_nothing_to_a_network_without_one(pictures, yaw):
    network = toy.Toy(8.0)
    np.testing.assert_array_equal(reconstructed(network, pictures, object_yaw=yaw),
                                  reconstructed(network, pictures))


@pytest.mark.parametrize('yaw', [0.3, 2.0, 5.5])
def test_a_network_with_a_front_answers_in_the_object_s_frame(network, pictures, yaw):
    expected = turned(reconstructed(network, pictures), yaw)
    np.testing.assert_allclose(
        reconstructed(network, pictures, yaw, object_yaw=yaw), expected, atol=1e-5)


@pytest.mark.parametrize('size', [0.1, 7.0])
def test_the_metre_makes_no_difference(pictures, size):
    network = toy.Toy(8.0)
    np.testing.assert_allclose(reconstructed(network, pictures, size=size),
                               reconstructed(network, pictures), atol=2e-3)


def test_a_batch_of_turned_cameras_is_that_of_cameras_turned():
    cameras = [orbit_camera(azimuth, 0.2, 1.5) for azimuth in AZIMUTHS[:5]]
    yaws = torch.linspace(0, 5, 5)
    found = Cameras.of(cameras).turned(yaws)
    expected = Cameras.of([camera.turned(yaw) for camera, yaw in zip(
        cameras, yaws.tolist(), strict=True)])
    torch.testing.assert_close(found, expected)
    azimuths = torch.tensor([camera.azimuth for camera in cameras]) + yaws
    torch.testing.assert_close(found.azimuths, azimuths.remainder(math.tau).float())
