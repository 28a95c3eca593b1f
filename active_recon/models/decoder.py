"""The 3D convolutional LSTM decoder of section 3.2: the attentive latent unit to occupancy."""

from active_recon.models.encoder import group_norm, LATENT_GRID
from active_recon.models.network import init_occupancy_bias
from active_recon.models.recurrent import ConvLSTMCell, LstmState
from active_recon.models.subpixel import SubpixelTransposedConv3d
from torch import nn, Tensor


class Decoder(nn.Module):
    """
    A 3D ConvLSTM and three (transposed) convolutions, each doubling the grid.

    - latent A_t: (B, 4 C, 4, 4), read as (B, C, 4, 4, 4) by the memory of V channels
    - logits of the occupancy: (B, 32, 32, 32), indexed [x, y, z]
    """

    def __init__(self, latent_channels: int, volume_channels: int,
                 decoder_channels: tuple[int, int]) -> None:
        super().__init__()
        self.latent_channels = latent_channels
        self.memory = ConvLSTMCell(latent_channels, volume_channels, (LATENT_GRID,) * 3)
        wide, narrow = decoder_channels
        to_logits = SubpixelTransposedConv3d(narrow)
        self.grow = nn.Sequential(
            nn.ConvTranspose3d(volume_channels, wide, 4, stride=2, padding=1), group_norm(wide),
            nn.LeakyReLU(0.1),
            nn.ConvTranspose3d(wide, narrow, 4, stride=2, padding=1), group_norm(narrow),
            nn.LeakyReLU(0.1),
            to_logits)
        init_occupancy_bias(to_logits.bias)

    def update(self, latent: Tensor, state: LstmState) -> LstmState:
        """Return the next state."""
        volume = latent.reshape(
            len(latent), self.latent_channels, LATENT_GRID, LATENT_GRID, LATENT_GRID)
        updated: LstmState = self.memory(volume, state)
        return updated

    def forward(self, hidden: Tensor) -> Tensor:
        """Return the logits of the memory's H_t, (B, V, 4, 4, 4) to (B, 32, 32, 32)."""
        logits: Tensor = self.grow(hidden)[:, 0]
        return logits
