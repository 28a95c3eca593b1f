"""The Octree Generating Network: what it divides, what it says, and that it can learn."""

from dataclasses import replace

from active_recon.errors import ConfigError
from active_recon.models.octree import EMPTY, FILLED, MIXED, states_of, tree_of
from active_recon.models.ogn import octree_report, Ogn, OgnConfig, SIZES
from active_recon.volumes.voxels import iou
import pytest
from shown_views import cameras_at
import torch
from torch.testing import assert_close

TINY = OgnConfig(image_channels=(4, 8, 8), code_channels=(16, 16), level_channels=(8, 6, 4, 4),
                 resolution=64)


def tiny_ogn():
    torch.manual_seed(0)
    return Ogn.from_config(TINY).eval()


def of_codes(codes):
    """Return the state whose mean codes are (B, D)."""
    return {'latent': codes[:, :, None, None]}


def answering(network, level, state, by=10.0):
    """Make a level answer one state, wherever it is asked."""
    with torch.no_grad():
        network.classify[level].weight.zero_()
        network.classify[level].bias.fill_(0)[state] = by
    return network


@pytest.fixture
def ball():
    """A ball, (2, 64, 64, 64), and a smaller one."""
    place = (torch.arange(64) - 31.5).square()
    distance = place[:, None, None] + place[:, None] + place
    return torch.stack([distance < 20 ** 2, distance < 14 ** 2])


@torch.no_grad()
def test_an_answer_of_empty_at_the_coarsest_level_makes_an_empty_grid():
    network = answering(tiny_ogn(), 0, EMPTY)
    logits = network.decode(of_codes(torch.rand(2, 16)))
    assert logits.shape == (2, 64, 64, 64)
    assert_close(logits, torch.full_like(logits, -10))
    assert len(list(network.levels(torch.rand(2, 16)))) == 1


@torch.no_grad()
def test_where_a_cell_ends_all_its_voxels_have_its_log_odds():
    network = answering(answering(tiny_ogn(), 0, MIXED), 1, FILLED, by=3.0)
    assert_close(network.decode(of_codes(torch.rand(1, 16))), torch.full((1, 64, 64, 64), 3.0))


@torch.no_grad()
def test_where_all_is_mixed_the_octree_is_the_dense_grid():
    network = tiny_ogn()
    for level in range(3):
        answering(network, level, MIXED)
    report = octree_report(network, torch.rand(2, 16))
    assert report['cells'] == report['dense_cells'] == {8: 512, 16: 4096, 32: 32768, 64: 262144}
    assert report['bytes'] == report['dense_bytes']


def test_in_training_the_cells_that_are_mixed_in_truth_are_divided(ball):
    truth = states_of(ball)
    found = [len(level.cells) for level in tiny_ogn().levels(torch.rand(2, 16), truth)]
    assert found == [len(cells) for cells in tree_of(truth)]


def test_the_report_counts_cells_and_bytes_of_what_is_predicted():
    network = answering(answering(tiny_ogn(), 0, MIXED), 1, EMPTY)
    report = octree_report(network, torch.rand(3, 16))
    assert report['cells'] == {8: 512, 16: 4096, 32: 0, 64: 0}
    assert report['bytes'] == {8: 512 * 8 * 4, 16: 4096 * 6 * 4, 32: 0, 64: 0}
    assert report['dense_bytes'][64] == 64 ** 3 * 4 * 4


@torch.no_grad()
def test_objects_of_a_batch_are_decoded_independently():
    torch.manual_seed(3)
    network, codes = tiny_ogn(), 3 * torch.rand(3, 16)
    together = network.decode(of_codes(codes))
    for index in range(3):
        assert_close(network.decode(of_codes(codes[index:index + 1])), together[index:index + 1],
                     rtol=1e-4, atol=1e-4)


def test_an_object_without_mixed_cells_has_an_objective_too():
    voxels = torch.zeros(2, 64, 64, 64)
    assert tiny_ogn().objective(of_codes(torch.rand(2, 16)), voxels).isfinite()


def test_voxels_of_another_resolution_are_refused_in_words():
    with pytest.raises(ConfigError, match='wrong resolution: expected voxels of 64 cells a side '
                       '.* got 32'):
        tiny_ogn().objective(of_codes(torch.rand(1, 16)), torch.zeros(1, 32, 32, 32))


@pytest.mark.parametrize(('size', 'resolution'), [('small', 32), ('published-64', 64)])
def test_the_resolution_is_that_of_the_size(size, resolution):
    with torch.device('meta'):
        network = Ogn.from_config(SIZES[size])
    assert network.resolution == SIZES[size].resolution == resolution


def learned(config, image, truth, steps):
    """Return the IoU of one object after training on it alone, and the network and its codes."""
    torch.manual_seed(0)
    network = Ogn.from_config(config)
    optimizer = torch.optim.Adam(network.parameters(), 5e-3)
    for step in range(steps):
        state = network.step(image, cameras_at([0]), network.initial_state(1))
        if step % 10 == 9:
            with torch.no_grad():
                best = iou(network.decode(state) > 0, truth).min().item()
            if best > 0.9:
                break
        optimizer.zero_grad()
        network.objective(state, truth.float()).backward()
        optimizer.step()
    return best, network, state['latent'].flatten(1)


@pytest.mark.slow
def test_a_small_network_learns_one_object_by_heart(views):
    config = OgnConfig(image_channels=(8, 8, 16), code_channels=(32,), level_channels=(16, 16, 8))
    image = views.white(torch.tensor([3]), torch.tensor([0]))
    best, _, _ = learned(config, image, views.voxels[3:4], 300)
    assert best > 0.9


@pytest.mark.slow
def test_at_64_cells_a_side_a_learned_octree_is_a_fraction_of_the_dense_grid(ball):
    config = replace(TINY, level_channels=(16, 16, 16, 8))
    best, network, codes = learned(config, torch.rand(1, 3, 64, 64), ball[:1], 200)
    report = octree_report(network, codes)
    assert best > 0.9
    assert sum(report['cells'].values()) < sum(report['dense_cells'].values()) / 5
    assert sum(report['bytes'].values()) < sum(report['dense_bytes'].values()) / 5
