"""The paper's policy at run time: the attentive-recurrent visual model's mean azimuth."""

import math

from active_recon.cameras import azimuth_difference, AZIMUTHS, TURN
from active_recon.errors import ViewError
from active_recon.models.attention import AttentionModel
from active_recon.models.encoder import LATENT_GRID
from active_recon.policies.base import are_apart, Choice, distance_to_taken, kept_apart
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_State = tuple[Tensor, Tensor]


class AttentionPolicy:
    """
    The mean of pi(u_t | theta; s_t), kept apart from the views taken; its state is the LSTM's.

    The paper's goes wherever the mean is, and so to the same view twice in half of its episodes:
    what the network has learned to see is what it goes back to. The model says how far apart.
    """

    def __init__(self, model: AttentionModel, sigma: float = 0.35) -> None:
        self._model = model
        self._sigma = sigma
        self._device = next(model.parameters()).device
        self._latent_shape = (model.where.out_features, LATENT_GRID, LATENT_GRID)

    @torch.inference_mode()
    def choose(self, latent: NDArray[np.float32], taken: NDArray[np.float64],
               state: _State | None = None) -> tuple[Choice, _State]:
        """
        Take the mean, or what is nearest to it and far enough from the views taken.

        An azimuth's worth is its log density, up to a constant; what is too near to a view is
        worth less than anything else, and the less the nearer.
        Raises ViewError where the latents are those of another model.
        """
        if latent.shape[1:] != self._latent_shape:
            raise ViewError(f'expected a latent of the shape {self._latent_shape}, as the policy '
                            f'was trained on, got {latent.shape[1:]}', 'latent')
        azimuth = torch.as_tensor(taken[:, -1], dtype=torch.float32, device=self._device)
        seen = torch.tensor(latent, device=self._device)
        proposal, state = self._model(seen, azimuth, state)
        mean = proposal.mean_azimuth.cpu().numpy().astype(np.float64) % TURN
        away = azimuth_difference(AZIMUTHS[None], mean[:, None]) / self._sigma
        separation = self._model.view_separation
        lack = separation - distance_to_taken(taken)
        worth = np.where(are_apart(taken, separation), -away ** 2 / 2,
                         -(math.pi / self._sigma) ** 2 / 2 - lack / self._sigma)
        goal = kept_apart(mean, taken, separation)
        return Choice(goal, worth.astype(np.float32)), state
