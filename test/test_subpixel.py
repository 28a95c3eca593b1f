"""The last layers of dense decoders, against the plain layers that they stand for."""

from active_recon.models.subpixel import SubpixelConv3d, SubpixelTransposedConv3d
import torch
from torch import nn
from torch.nn import functional
from torch.testing import assert_close


def test_a_subpixel_convolution_represents_upsampling_and_a_convolution():
    coarse, fine = torch.rand(2, 3, 4, 4, 4), nn.Conv3d(3, 1, 3, padding=1)
    layer = SubpixelConv3d(3)
    # A child at 0 sees its parent by two taps and the parent before by one; at 1 the reverse
    taps = {0: ((0,), (1, 2), ()), 1: ((), (0, 1), (2,))}
    with torch.no_grad():
        for index, corner in enumerate(torch.cartesian_prod(*(torch.arange(2),) * 3).tolist()):
            for cell in torch.cartesian_prod(*(torch.arange(3),) * 3).tolist():
                x, y, z = (list(taps[c][t]) for c, t in zip(corner, cell, strict=True))
                layer.to_eight.weight[index, :, *cell] = (
                    fine.weight[0][:, x][:, :, y][:, :, :, z].sum((1, 2, 3)))
            layer.to_eight.bias[index] = fine.bias[0]
    assert_close(layer(coarse), fine(functional.interpolate(coarse, scale_factor=2)))


def in_bfloat16(layer, features):
    with torch.autocast('cpu', torch.bfloat16):
        return layer(features.bfloat16()).float()


def test_a_transposed_convolution_says_the_same_in_half_precision():
    layer, coarse = SubpixelTransposedConv3d(3), torch.rand(2, 3, 5, 5, 5).bfloat16().float()
    with torch.no_grad():
        for part in layer.parameters():
            part.copy_(part.bfloat16())  # what half precision makes of it anyway
        assert_close(in_bfloat16(layer, coarse), layer(coarse), rtol=2 ** -7, atol=2 ** -9)


def test_its_kernel_is_that_of_the_transposed_convolution():
    layer, coarse = SubpixelTransposedConv3d(2).double(), torch.rand(1, 2, 4, 4, 4).double()
    plain = nn.ConvTranspose3d.forward(layer, coarse)[:, 0]
    eight = functional.conv3d(coarse, layer.to_eight(), layer.bias.expand(8), padding=1)
    for index, (x, y, z) in enumerate(torch.cartesian_prod(*(torch.arange(2),) * 3).tolist()):
        assert_close(eight[:, index], plain[:, x::2, y::2, z::2])


def test_its_weights_learn_alike_in_half_precision():
    layer, coarse = SubpixelTransposedConv3d(2), torch.rand(1, 2, 4, 4, 4).bfloat16().float()
    weighing = torch.rand(1, 1, 8, 8, 8)
    gradients = []
    for found in (layer(coarse), in_bfloat16(layer, coarse)):
        gradients.append(torch.autograd.grad((found * weighing).sum(), list(layer.parameters())))
    assert_close(gradients[1], gradients[0], rtol=2e-2, atol=2e-2)
