"""What a frozen network is shown of a set of objects."""

from active_recon.errors import ViewError
from active_recon.evaluation.rollouts import Observer, roll_out
from active_recon.policies import Choice
import numpy as np
import pytest
from shown_views import part_of
import torch
from torch.testing import assert_close


@pytest.fixture
def looked_at(network, monkeypatch):
    """Return a list that the number of images of every encoding is added to."""
    counts, encode = [], network.encode
    monkeypatch.setattr(network, 'encode', lambda images, cameras: (
        counts.append(len(images)) or encode(images, cameras)))
    return counts


@torch.inference_mode()
def test_an_observer_knows_what_the_network_knows(network, views):
    observer, objects = Observer(network, views), torch.tensor([0, 0, 3])
    state = own = network.initial_state(3)
    for chosen in (torch.tensor([5, 5, 5]), torch.tensor([1, 5, 2])):
        state = observer.update(objects, chosen, state)
        logits, own = network(views.white(objects, chosen), views.cameras(objects, chosen), own)
        assert_close(state['latent'], own['latent'], rtol=0, atol=1e-3)
        assert_close(observer.decode(state), logits, rtol=0, atol=1e-2)


class Undecided:
    """A policy whose scores leave no order."""

    wants_volume = False

    def initial_state(self, batch):
        return {}

    def choose(self, seen, state):
        return Choice(np.full((len(seen.latent), 24), np.nan)), state


def test_a_policy_without_finite_scores_is_refused_where_it_is_measured(network, views):
    with pytest.raises(ViewError, match='no usable scores: expected .* with 72 NaN'):
        list(roll_out(network, Undecided(), views, torch.arange(3), torch.zeros(3).long(), 2))


class Fails(Undecided):
    """A policy with a fault of its own."""

    def __init__(self, where):
        setattr(self, where, lambda *_: 1 / 0)


@pytest.mark.parametrize(('where', 'said'), [('choose', ''), ('initial_state', ' initial_state')])
def test_a_policy_that_fails_is_told_where_it_is_measured(network, views, where, said):
    with pytest.raises(ViewError, match=f'policy:{said} fails with ZeroDivisionError: division'):
        list(roll_out(network, Fails(where), views, torch.arange(3), torch.zeros(3).long(), 2))


class Fond(Undecided):
    """A policy that likes the first views best, whatever was taken."""

    def choose(self, seen, state):
        scores = -np.arange(seen.candidates.shape[1], dtype=np.float32)
        return Choice(np.tile(scores, (len(seen.latent), 1))), state


def test_no_view_is_taken_twice_while_there_are_others(network, views):
    few = part_of(views, chosen=slice(None, None, 8))
    objects, starts = torch.tensor([0, 4]), torch.tensor([0, 1])
    *_, whole, again = roll_out(network, Fond(), few, objects, starts, 4)
    azimuths = few.azimuths[0].double().numpy()
    np.testing.assert_array_equal(whole.taken, azimuths[[[0, 1, 2], [1, 0, 2]]])
    np.testing.assert_array_equal(again.taken[:, -1], azimuths[[0, 0]])


@torch.inference_mode()
def test_an_observer_encodes_every_view_once(network, views, looked_at):
    observer, objects = Observer(network, views), torch.tensor([0, 0, 3, 3])
    state = network.initial_state(4)
    for chosen in ([1, 1, 1, 2], [1, 2, 1, 0], [2, 1, 0, 0]):
        observer.update(objects, torch.tensor(chosen), state)
    assert looked_at == [3, 2]  # then view 2 of object 0 and view 0 of object 3


@torch.inference_mode()
def test_a_front_that_is_told_wrongly_reaches_the_network(network, views, monkeypatch):
    told, update = [], network.update
    monkeypatch.setattr(network, 'update', lambda encoded, cameras, state: (
        told.append(cameras), update(encoded, cameras, state))[1])
    objects, chosen = torch.tensor([0, 1]), torch.tensor([3, 4])
    Observer(network, views).update(objects, chosen, network.initial_state(2),
                                    yaws=torch.tensor([0.5, -0.5]))
    assert_close(told[0].azimuths, views.azimuths[objects, chosen] + torch.tensor([0.5, -0.5]))
    assert_close(told[0].intrinsics, views.intrinsics[objects, chosen])
    assert_close(told[0].poses[:, 2], views.poses[objects, chosen][:, 2])  # all heights
