"""Recurrent memory: the convolutional LSTM with peepholes of sections 3.1 and 3.2."""

from typing import NamedTuple

import torch
from torch import nn, Tensor


class LstmState(NamedTuple):
    """The state of a cell: H_{t-1} and C_{t-1}, each (B, hidden, *grid)."""

    hidden: Tensor
    memory: Tensor


class ConvLSTMCell(nn.Module):
    """
    One step of a convolutional LSTM, in 2 or 3 dimensions (equation of section 3.1).

    Shapes, for B objects and a grid of S cells a side:

    - features: (B, F, S, S) or (B, F, S, S, S), the X_t of this view
    - state: H and C, (B, H, S, S) or (B, H, S, S, S)

    The peephole terms W_c act element by element, as in the original ConvLSTM (Shi et al. 2015).
    The caller owns the state; the cell keeps nothing between calls.
    """

    def __init__(self, feature_channels: int, hidden_channels: int, grid: tuple[int, ...],
                 kernel_size: int = 3) -> None:
        super().__init__()
        if kernel_size % 2 == 0:
            raise ValueError(f'kernel_size must be odd to keep the grid size, got {kernel_size}')
        if len(grid) not in (2, 3):
            raise ValueError(f'grid must have 2 or 3 dimensions, got {grid}')
        self.hidden_channels = hidden_channels
        convolution = nn.Conv2d if len(grid) == 2 else nn.Conv3d
        self.gates = convolution(feature_channels + hidden_channels, 4 * hidden_channels,
                                 kernel_size, padding=kernel_size // 2)
        self.peepholes = nn.Parameter(torch.zeros(3, hidden_channels, *grid))
        with torch.no_grad():  # an open forget gate lets gradients flow to early views
            assert self.gates.bias is not None
            self.gates.bias[:hidden_channels].fill_(1.0)

    def initial_state(self, batch: int) -> LstmState:
        """Return the memory of so many objects before any view, on the cell's device."""
        empty = self.peepholes.new_zeros(batch, *self.peepholes.shape[1:])
        return LstmState(empty, empty)

    def forward(self, features: Tensor, state: LstmState) -> LstmState:
        """Return H_t and C_t."""
        forget, enter, proposal, out = self.gates(
            torch.cat([features, state.hidden], dim=1)).chunk(4, dim=1)
        peek_forget, peek_enter, peek_out = self.peepholes
        keep = (forget + peek_forget * state.memory).sigmoid()
        admit = (enter + peek_enter * state.memory).sigmoid()
        memory = keep * state.memory + admit * proposal.tanh()
        hidden = (out + peek_out * memory).sigmoid() * memory.tanh()
        return LstmState(hidden, memory)
