"""Measurements on validation objects, for monitoring trainings and choosing thresholds."""

from active_recon.datasets.views import ViewSet
from active_recon.evaluation.metrics import episodes, iou_per_view, THRESHOLDS
from active_recon.models.network import ReconstructionNetwork
from active_recon.policies import Policy
from active_recon.policies.geometric import RandomPolicy
import numpy as np

_MONITOR_THRESHOLD = np.array([0.4])


def reconstruction_iou(network: ReconstructionNetwork, views: ViewSet) -> dict[str, float]:
    """Return the IoU after 1 and 5 random views at a threshold of 0.4, one start per object."""
    objects, starts = episodes(views, 1)
    policy = RandomPolicy(np.random.default_rng(0))
    values = iou_per_view(network, policy, views, objects, starts, _MONITOR_THRESHOLD)
    return {'validation_iou_1': values[:, 0].mean(), 'validation_iou_5': values[:, 4].mean()}


def best_threshold(network: ReconstructionNetwork, views: ViewSet) -> float:
    """Return the threshold with the highest mean IoU over 1 to 5 random views, two starts each."""
    network.eval()
    objects, starts = episodes(views, 2)
    policy = RandomPolicy(np.random.default_rng(0))
    values = iou_per_view(network, policy, views, objects, starts, THRESHOLDS)
    return float(THRESHOLDS[values.mean(axis=(0, 1)).argmax()])


def policy_auc(network: ReconstructionNetwork, learned: Policy, views: ViewSet,
               threshold: float) -> dict[str, float]:
    """Return the mean IoU over views 1 to 5 of a learned policy and of random views."""
    objects, starts = episodes(views, 2)
    at = np.array([threshold])
    policies: dict[str, Policy] = {'validation_auc': learned,
                                  'validation_auc_random': RandomPolicy(np.random.default_rng(0))}
    return {name: iou_per_view(network, policy, views, objects, starts, at).mean()
            for name, policy in policies.items()}
