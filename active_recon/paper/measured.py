"""Measurements of a network and a policy on a set of objects, cached on disk."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from active_recon.config import LossConfig
from active_recon.datasets.views import ViewSet
from active_recon.evaluation.blocks import run_blocks
from active_recon.evaluation.contenders import contenders
from active_recon.evaluation.measure import Episodes
from active_recon.evaluation.rollouts import batches, roll_out
from active_recon.evaluation.statistics import Values
from active_recon.evaluation.trial import Contender, read_arrays, Trial, write_arrays
from active_recon.geometry.cameras import AZIMUTHS, orbit_camera
from active_recon.models.network import ReconstructionNetwork
from active_recon.models.weights import load_weights
from active_recon.paper.study import Objects, Study
from active_recon.policies import Choice, Observation
from active_recon.policies.geometric import HeuristicPolicy
from active_recon.runtimes import State
from active_recon.volumes.silhouettes import frustum, project_all
import numpy as np
from numpy.typing import NDArray
import torch
from torch import Tensor

_BATCH = 32


@dataclass(frozen=True, eq=False)
class Measured:
    """
    Episodes of N objects from S starts, after each of T views.

    - iou, entropy, paper_entropy (nats): (N, S, T)
    - categories: (N,)
    """

    iou: Values
    entropy: Values
    paper_entropy: Values
    categories: NDArray[np.str_]


def measure(study: Study, weights: Path, policy: str, objects: Objects) -> Measured:
    """Run a policy on every object from the study's starts, or read the cached episodes."""
    trial, _, run = _run(study, weights, policy, objects)
    shape = len(trial.views), study.starts, study.views
    return Measured(run.iou.reshape(shape), run.entropy.reshape(shape),
                    run.paper_entropy.reshape(shape), trial.views.categories)


def measure_loss(study: Study, weights: Path, policy: str, objects: Objects,
                 loss: LossConfig) -> Values:
    """
    Return the loss of section 3.2, lambda_V L(V) + lambda_S L(S), after every view, (N, S, T).

    L(S) is the mean over 24 silhouettes.
    """
    trial, key, run = _run(study, weights, policy, objects)
    assert trial.folder is not None
    path = trial.folder / f'loss-{loss.volume_weight}-{loss.silhouette_weight}-{key}.npz'
    if path.is_file():
        losses = read_arrays(path, {'loss'})['loss']
    else:
        with study.progress(f'losses, {weights.parent.name}, {policy}',
                            len(trial.objects)) as advance:
            parts = []
            for part in batches(len(trial.objects), _BATCH):
                parts.append(_losses(trial.network, trial.views, trial.objects[part],
                                     trial.starts[part], run.azimuths[part.numpy()], loss))
                advance(len(part), '')
        losses = np.concatenate(parts)
        write_arrays(path, loss=losses)
    return losses.reshape(len(trial.views), study.starts, study.views)


def _run(study: Study, weights: Path, policy: str,
         objects: Objects) -> tuple[Trial, str, Episodes]:
    trial, [contender] = _prepared(study, weights, policy, objects)
    if study.crew is not None:
        run_blocks(partial(_prepared, study.elsewhere(), weights.absolute(), policy,
                           objects.elsewhere()),
                   trial, [contender], study.crew, [weights, objects.root], study.progress)
    title = f'{weights.parent.name}, {policy}, {objects.root.name}'
    with study.progress(title, len(trial.objects)) as advance:
        return trial, contender.key, trial.run(contender, lambda done: advance(done, ''))


def _prepared(study: Study, weights: Path, policy: str,
              objects: Objects) -> tuple[Trial, list[Contender]]:
    """Return the trial of a network on objects, and the policy as its contender."""
    bundle = load_weights(weights, study.device)
    trial = Trial(bundle.reconstruction, bundle.threshold, study.read(objects), study.starts,
                  study.views, study.seed, cache=study.models / 'measured')
    models = [bundle.attention] if bundle.attention is not None else []
    return trial, contenders([policy], models, study.views, seeds=1, seed=study.seed,
                             model=bundle.model)


class Retaken(HeuristicPolicy):
    """A policy that repeats known azimuths, radians, (B, T)."""

    def __init__(self, azimuths: Values) -> None:
        self._azimuths = azimuths

    def choose(self, seen: Observation, state: State) -> tuple[Choice, State]:
        """Return the next known azimuth of each episode; see Policy."""
        goals = self._azimuths[:, seen.taken.shape[1]]
        return Choice(np.zeros(seen.candidates.shape[:2], np.float32), goals), state


@torch.inference_mode()
def _losses(network: ReconstructionNetwork, views: ViewSet, items: Tensor, starts: Tensor,
            azimuths: Values, loss: LossConfig) -> Values:
    """Return the loss after every view of episodes with known azimuths, (B, T)."""
    frusta = frustum([orbit_camera(azimuth) for azimuth in AZIMUTHS])
    truth = views.voxels[items].float()
    outlines = project_all(truth, frusta)
    steps = []
    for step in roll_out(network, Retaken(azimuths), views, items, starts, azimuths.shape[1]):
        occupancy = step.occupancy.cpu()
        volume = (occupancy - truth).square().mean(dim=(1, 2, 3))
        silhouettes = (project_all(occupancy, frusta) - outlines).square().mean(dim=(1, 2, 3))
        steps.append(loss.volume_weight * volume + loss.silhouette_weight * silhouettes)
    return np.asarray(torch.stack(steps, dim=1).double().numpy())
