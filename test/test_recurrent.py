"""The recurrent memory: what it keeps, what it takes in, what it refuses."""

import math

from active_recon.models.recurrent import ConvLSTMCell, LstmState
import pytest
import torch
from torch.testing import assert_close

FORGET, ENTER, PROPOSAL, OUT = range(4)


@pytest.fixture(params=[2, 3], ids=['2D', '3D'])
def grid(request) -> tuple[int, ...]:
    return (4,) * request.param


@pytest.fixture
def cell(grid) -> ConvLSTMCell:
    torch.manual_seed(0)
    cell = ConvLSTMCell(feature_channels=3, hidden_channels=2, grid=grid)
    torch.nn.init.normal_(cell.peepholes)
    return cell


def some_state(batch, grid):
    return LstmState(torch.randn(batch, 2, *grid), torch.randn(batch, 2, *grid))


def set_gate(cell, gate, value):
    """Hold a gate at a value whatever comes in: a bias so large drowns the rest."""
    with torch.no_grad():
        cell.gates.bias.view(4, cell.hidden_channels)[gate] = value


def test_memory_starts_empty_and_keeps_its_shape(cell, grid):
    features = torch.randn(5, 3, *grid)
    state = cell.initial_state(5)
    assert not state.hidden.any()
    assert not state.memory.any()
    after = cell(features, state)
    assert after.hidden.shape == after.memory.shape == state.hidden.shape == (5, 2, *grid)


def test_objects_of_a_batch_do_not_mix(cell, grid):
    features, state = torch.randn(2, 3, *grid), some_state(2, grid)
    alone = cell(features[:1], LstmState(*(part[:1] for part in state)))
    for together, single in zip(cell(features, state), alone, strict=True):
        assert_close(together[:1], single)


def test_the_cell_remembers_nothing_by_itself(cell, grid):
    features, state = torch.randn(1, 3, *grid), some_state(1, grid)
    first = cell(features, state)
    cell(torch.randn(1, 3, *grid), some_state(1, grid))
    assert_close(cell(features, state), first, rtol=0, atol=0)


def test_an_open_forget_gate_and_a_closed_input_gate_keep_the_memory_and_its_gradient(cell, grid):
    set_gate(cell, FORGET, 100.0)
    set_gate(cell, ENTER, -100.0)
    state = some_state(1, grid)
    state.memory.requires_grad_()
    after = cell(torch.randn(1, 3, *grid), state)
    after.memory.sum().backward()
    assert_close(after.memory, state.memory)
    assert_close(state.memory.grad, torch.ones_like(state.memory))


def test_a_closed_forget_gate_and_an_open_input_gate_replace_the_memory(cell, grid):
    set_gate(cell, FORGET, -1000.0)
    set_gate(cell, ENTER, 1000.0)
    state = LstmState(torch.zeros(1, 2, *grid), torch.full((1, 2, *grid), 7.0))
    assert cell(torch.randn(1, 3, *grid), state).memory.abs().max() <= 1  # tanh proposes no 7


def test_a_closed_output_gate_shows_nothing_of_what_is_kept(cell, grid):
    set_gate(cell, OUT, -100.0)
    after = cell(torch.randn(1, 3, *grid), some_state(1, grid))
    assert after.hidden.abs().max() < 1e-6
    assert after.memory.abs().max() > 0.1


def test_without_peepholes_it_is_the_plain_convolutional_lstm(cell, grid):
    torch.nn.init.zeros_(cell.peepholes)
    features, state = torch.randn(2, 3, *grid), some_state(2, grid)
    forget, enter, proposal, out = cell.gates(
        torch.cat([features, state.hidden], dim=1)).chunk(4, dim=1)
    memory = forget.sigmoid() * state.memory + enter.sigmoid() * proposal.tanh()
    after = cell(features, state)
    assert_close(after.memory, memory)
    assert_close(after.hidden, out.sigmoid() * memory.tanh())


@pytest.mark.parametrize('dimensions', [2, 3])
def test_it_computes_the_equation_of_the_paper(dimensions):
    cell = ConvLSTMCell(1, 1, (1,) * dimensions)  # one number each: the equation by hand
    weights = {'xf': 0.3, 'hf': -0.7, 'xi': 0.9, 'hi': 0.2, 'xc': -0.4, 'hc': 1.1, 'xo': 0.6,
               'ho': -0.5, 'cf': 0.8, 'ci': -1.2, 'co': 0.35}
    biases = {'f': 0.1, 'i': -0.2, 'c': 0.3, 'o': -0.4}
    x, h, c = 0.75, -0.6, 1.4
    middle = (1,) * dimensions  # of the 3 x 3 kernel: the rest meets only padding
    with torch.no_grad():
        cell.gates.weight.normal_()
        for row, gate in enumerate('fico'):
            cell.gates.weight[(row, 0, *middle)] = weights[f'x{gate}']
            cell.gates.weight[(row, 1, *middle)] = weights[f'h{gate}']
            cell.gates.bias[row] = biases[gate]
        for row, gate in enumerate('fio'):
            cell.peepholes[row] = weights[f'c{gate}']

    def sigmoid(value):
        return 1 / (1 + math.exp(-value))

    w = weights
    f = sigmoid(w['xf'] * x + w['hf'] * h + w['cf'] * c + biases['f'])
    i = sigmoid(w['xi'] * x + w['hi'] * h + w['ci'] * c + biases['i'])
    memory = f * c + i * math.tanh(w['xc'] * x + w['hc'] * h + biases['c'])
    o = sigmoid(w['xo'] * x + w['ho'] * h + w['co'] * memory + biases['o'])
    one = torch.ones(1, 1, *middle)
    after = cell(x * one, LstmState(h * one, c * one))
    assert after.memory.item() == pytest.approx(memory, abs=1e-6)
    assert after.hidden.item() == pytest.approx(o * math.tanh(memory), abs=1e-6)


def test_the_forget_gate_starts_open(grid):
    bias = ConvLSTMCell(3, 2, grid).gates.bias.view(4, 2)
    assert (bias[FORGET] == 1).all()
    assert (bias[ENTER:] < 1).all()


@pytest.mark.parametrize('kernel_size', [2, 4])
def test_an_even_kernel_is_refused(grid, kernel_size):
    with pytest.raises(ValueError, match=f'must be odd.*got {kernel_size}'):
        ConvLSTMCell(3, 2, grid, kernel_size)


@pytest.mark.parametrize('size', [(), (4,), (4, 4, 4, 4)])
def test_a_grid_that_is_neither_image_nor_volume_is_refused(size):
    with pytest.raises(ValueError, match='2 or 3 dimensions'):
        ConvLSTMCell(3, 2, size)
