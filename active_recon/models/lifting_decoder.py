"""What views agree on to occupancy: a small U-Net, and the hull at full fineness."""

from active_recon.models.encoder import group_norm
import torch
from torch import nn, Tensor
from torch.nn import functional

FINE_SIDE = 32
_BEGIN = (0.5, 0.5, -2.0)  # biases of what is learned at 64 cells


class Conv3d(nn.Conv3d):
    """
    3 x 3 x 3 convolution that oneDNN computes for a single small volume too.

    For those torch takes its plain loop in float32, which takes ten times as long at 16 cells.
    """

    def __init__(self, channels: int) -> None:
        super().__init__(channels, channels, 3, padding=1)

    def forward(self, cells: Tensor) -> Tensor:
        """Return cells of the same shape."""
        if (torch.is_grad_enabled() or torch.compiler.is_compiling()
                or cells.device.type != 'cpu' or cells.dtype != torch.float32
                or torch.is_autocast_enabled('cpu')):
            return super().forward(cells)
        found: Tensor = torch.mkldnn_convolution(
            cells, self.weight, self.bias, (1, 1, 1), (1, 1, 1), (1, 1, 1), 1)
        return found


class Residual3d(nn.Module):
    """3 x 3 x 3 convolutions beside the identity."""

    def __init__(self, channels: int, depth: int) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for number in range(depth):
            layers += [Conv3d(channels), group_norm(channels)]
            layers += [nn.ReLU()] if number + 1 < depth else []
        self.layers = nn.Sequential(*layers)

    def forward(self, cells: Tensor) -> Tensor:
        """Return cells of the same shape."""
        return functional.relu(cells + self.layers(cells))


def folded(cells: Tensor) -> Tensor:
    """Fold cells (B, C, 2n, 2n, 2n) into those twice as large, (B, 8 C, n, n, n)."""
    batch, channels, side = cells.shape[:3]
    n = side // 2
    split = cells.reshape(batch, channels, n, 2, n, 2, n, 2)
    return split.permute(0, 1, 3, 5, 7, 2, 4, 6).reshape(batch, 8 * channels, n, n, n)


def unfolded(cells: Tensor) -> Tensor:
    """Unfold cells (B, 8 C, n, n, n) into those half as large, (B, C, 2n, 2n, 2n)."""
    batch, channels, n = cells.shape[:3]
    split = cells.reshape(batch, channels // 8, 2, 2, 2, n, n, n)
    return split.permute(0, 1, 5, 2, 6, 3, 7, 4).reshape(
        batch, channels // 8, 2 * n, 2 * n, 2 * n)


class HullUnet(nn.Module):
    """
    A U-Net at 16, 8 and 4 cells a side, unfolded to 32 and 64, where the hull joins in.

    `coarse` and `fine` are the channels that come in at 16 and 32 cells; `channels` those at 16,
    8 and 4; `head` those at 32. The logits are the network's plus a learned
    scale, for each cell its own, times the log of the least, and of the second least, foreground
    probability of all views; that of the least is 1 at least. What the silhouettes leave no room
    for stays empty without being learned.
    """

    def __init__(self, coarse: int, fine: int, channels: tuple[int, int, int],
                 head: int) -> None:
        super().__init__()
        at_16, at_8, at_4 = channels
        self.fine_in = nn.Sequential(nn.Conv3d(fine + 8, head, 1), nn.ReLU())
        self.enter = nn.Sequential(
            nn.Conv3d(coarse + 8 * head, at_16, 1), group_norm(at_16), nn.ReLU())
        self.down_16 = Residual3d(at_16, 1)
        self.to_8 = nn.Sequential(nn.Conv3d(at_16, at_8, 2, stride=2), group_norm(at_8), nn.ReLU())
        self.down_8 = Residual3d(at_8, 2)
        self.to_4 = nn.Sequential(nn.Conv3d(at_8, at_4, 2, stride=2), group_norm(at_4), nn.ReLU())
        self.at_4 = Residual3d(at_4, 2)
        self.from_4, self.up_8 = nn.Conv3d(at_4, 8 * at_8, 1), Residual3d(at_8, 2)
        self.from_8, self.up_16 = nn.Conv3d(at_8, 8 * at_16, 1), Residual3d(at_16, 2)
        self.to_32 = nn.Conv3d(at_16, 8 * head, 1)
        self.skip_32 = nn.Conv3d(head, head, 1)
        self.to_64 = nn.Conv3d(head, 8 * 3, 1)
        # It begins as the hull, of which training takes away and to which it adds
        with torch.no_grad():
            self.to_64.weight.mul_(0.1)
        self.to_64.bias = nn.Parameter(torch.tensor(_BEGIN).repeat_interleave(8))
        self.logit_32 = nn.Conv3d(head, 1, 1)

    def forward(self, coarse: Tensor, fine: Tensor, hull: Tensor) -> tuple[Tensor, Tensor]:
        """
        Return logits (B, 64, 64, 64), and rougher ones (B, 32, 32, 32).

        Takes (B, coarse, 16, 16, 16), (B, fine, 32, 32, 32), and the two least logits of the
        foreground, (B, 2, 64, 64, 64).
        """
        carved = functional.logsigmoid(hull)
        entered = self.fine_in(torch.cat([fine, folded(carved[:, :1])], dim=1))
        at_16 = self.enter(torch.cat([coarse, folded(entered)], dim=1))
        if not self.training:  # convolutions take two thirds of the time; what trains takes more
            at_16 = at_16.contiguous(memory_format=torch.channels_last_3d)
        at_16 = self.down_16(at_16)
        at_8 = self.down_8(self.to_8(at_16))
        at_4 = self.at_4(self.to_4(at_8))
        at_8 = self.up_8(at_8 + unfolded(self.from_4(at_4)))
        at_16 = self.up_16(at_16 + unfolded(self.from_8(at_8)))
        at_32 = functional.relu(unfolded(self.to_32(at_16)) + self.skip_32(entered))
        learned = unfolded(self.to_64(at_32))  # (B, 3, 64, 64, 64)
        scales = functional.softplus(learned[:, 1:])
        logits = learned[:, 0] + carved[:, 0] + (scales * carved).sum(dim=1)
        return logits, self.logit_32(at_32)[:, 0]
