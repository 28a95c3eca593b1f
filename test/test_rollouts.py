"""What a frozen network is shown of a set of objects."""

from active_recon.evaluation.rollouts import Observer
import pytest
import torch
from torch.testing import assert_close


@pytest.fixture
def looked_at(network, monkeypatch):
    """Return a list that the number of images of every look is added to."""
    counts, look = [], network.look
    monkeypatch.setattr(network, 'look', lambda images: counts.append(len(images)) or look(images))
    return counts


@torch.inference_mode()
def test_an_observer_knows_what_the_network_knows(network, views):
    observer, hidden, own = Observer(network, views), None, None
    objects = torch.tensor([0, 0, 3])
    for chosen in (torch.tensor([5, 5, 5]), torch.tensor([1, 5, 2])):
        folded, hidden = observer.fold(objects, chosen, hidden)
        seen, own = network(views.white(objects, chosen), views.azimuths[objects, chosen], own)
        assert_close(folded.latent, seen.latent, rtol=0, atol=1e-3)
        assert_close(observer.decode(folded), seen.logits, rtol=0, atol=1e-2)


@torch.inference_mode()
def test_an_observer_looks_at_every_view_once(network, views, looked_at):
    observer, objects = Observer(network, views), torch.tensor([0, 0, 3, 3])
    observer.fold(objects, torch.tensor([1, 1, 1, 2]))
    observer.fold(objects, torch.tensor([1, 2, 1, 0]))
    observer.fold(objects, torch.tensor([2, 1, 0, 0]))
    assert looked_at == [3, 2]  # then view 2 of object 0 and view 0 of object 3


@torch.inference_mode()
def test_a_front_that_is_told_wrongly_reaches_the_network(network, views, monkeypatch):
    told, remember = [], network.remember
    monkeypatch.setattr(network, 'remember', lambda seen, azimuths, hidden=None: (
        told.append(azimuths), remember(seen, azimuths, hidden))[1])
    objects, chosen = torch.tensor([0, 1]), torch.tensor([3, 4])
    Observer(network, views).fold(objects, chosen, yaws=torch.tensor([0.5, -0.5]))
    assert_close(told[0], views.azimuths[objects, chosen] + torch.tensor([0.5, -0.5]))
