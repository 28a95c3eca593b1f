"""What a network makes of one object that it sees again and again."""

from active_recon.training.losses import volume_loss
from active_recon.volumes.voxels import iou
import torch


def iou_by_heart(network, views, wanted=0.9, steps=300):
    """Train on three views of one object until the worst IoU is as wanted; return that IoU."""
    optimizer = torch.optim.Adam(network.parameters(), 5e-3)
    objects, chosen = torch.tensor([3, 3, 3]), torch.tensor([0, 7, 15])
    images, truth = views.white(objects, chosen), views.voxels[objects]
    cameras, best = views.cameras(objects, chosen), 0.0
    for _ in range(steps):
        logits, _ = network(images, cameras, network.initial_state(3))
        best = iou(logits > 0, truth).min().item()
        if best > wanted:
            break
        optimizer.zero_grad()
        volume_loss(logits, truth.float(), 'bce').backward()
        optimizer.step()
    return best
