"""The attentive-recurrent visual model of section 3.3: the choice of the next view."""

from typing import Any, NamedTuple

from active_recon.models.encoder import LATENT_GRID
from active_recon.models.network import State
from active_recon.models.network_2d3d import Network2d3dConfig
import torch
from torch import nn, Tensor
from torch.nn import functional


class Attention(NamedTuple):
    """The model's output: the mean azimuth (B,), radians in (-pi, pi], and b_t (B,)."""

    mean_azimuth: Tensor
    baseline: Tensor


class AttentionModel(nn.Module):
    """
    Glimpse, LSTM, location and baseline (figures 3 and 4).

    - latent A_t: (B, 4 C, 4, 4), azimuth l_t of the view just taken: (B,) radians
    - state: the LSTM's h and c as `hidden` and `memory`, (B, hidden) each

    The glimpse is g_t = A_t * ReLU(W [sin l_t, cos l_t]), broadcast over the grid: a product with
    the angle itself would erase A_t at azimuth 0. The mean azimuth is the angle of a 2-vector. A
    policy keeps its goals `view_separation`, radians, from every view taken, as in training.
    """

    def __init__(self, latent_channels: int, hidden_channels: int,
                 view_separation: float = 0.0) -> None:
        super().__init__()
        self.view_separation = view_separation
        channels = latent_channels * LATENT_GRID
        self.where = nn.Linear(2, channels)
        self.memory = nn.LSTMCell(channels * LATENT_GRID ** 2, hidden_channels)
        self.location = nn.Linear(hidden_channels, 2)
        self.baseline = nn.Linear(hidden_channels, 1)

    @classmethod
    def from_config(cls, config: Network2d3dConfig) -> 'AttentionModel':
        """Build the model of a configuration, with fresh weights."""
        return cls(config.latent_channels, config.glimpse_channels, config.view_separation)

    @property
    def facts(self) -> dict[str, Any]:
        """The constants that a policy needs: `view_separation`, and A_t's `latent_shape`."""
        return {'view_separation': self.view_separation,
                'latent_shape': (self.where.out_features, LATENT_GRID, LATENT_GRID)}

    def initial_state(self, batch: int) -> State:
        """Return the state of B episodes before any view, zeros of (B, hidden)."""
        empty = self.memory.weight_hh.new_zeros(batch, self.memory.hidden_size)
        return {'hidden': empty, 'memory': empty}

    def forward(self, latent: Tensor, azimuth: Tensor,
                state: State) -> tuple[Attention, State]:
        """Return the proposal after this view and the next state."""
        direction = torch.stack([azimuth.sin(), azimuth.cos()], dim=-1)
        gate = functional.relu(self.where(direction))  # (B, 4 C)
        glimpse = (latent * gate[:, :, None, None]).flatten(1)  # (B, 4 C x 16)
        hidden, memory = self.memory(glimpse, (state['hidden'], state['memory']))
        sine, cosine = self.location(hidden).unbind(dim=-1)
        # The baseline learns from the return alone; its gradient must not shape the policy.
        baseline = self.baseline(hidden.detach())[:, 0]
        proposal = Attention(torch.atan2(sine, cosine), baseline)
        return proposal, {'hidden': hidden, 'memory': memory}
