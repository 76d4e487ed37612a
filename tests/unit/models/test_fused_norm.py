from __future__ import annotations

import copy
import os
import shutil
import tempfile
import unittest
from unittest import mock

import torch
from torch import nn

import fused_norm
from network import Conv


@unittest.skipUnless(shutil.which(os.environ.get("CXX", "g++")), "there is no C++ compiler")
class FusedNorm(unittest.TestCase):
    """Against PyTorch in double precision, from the same bfloat16 values."""

    @classmethod
    def setUpClass(cls):
        cls.cache = tempfile.TemporaryDirectory()
        with mock.patch.dict(os.environ, {"XDG_CACHE_HOME": cls.cache.name}):
            fused_norm.enable()

    @classmethod
    def tearDownClass(cls):
        fused_norm.NormSilu.library = None
        cls.cache.cleanup()

    def compare(self, channels: int, with_silu: bool, offset: float):
        torch.manual_seed(channels)
        bn = nn.BatchNorm2d(channels, eps=1e-3, momentum=0.03)
        nn.init.uniform_(bn.weight, 0.5, 1.5)
        nn.init.uniform_(bn.bias, -1, 1)
        exact = copy.deepcopy(bn).double()
        x = (2 * torch.randn(3, channels, 9, 7) + offset).bfloat16().contiguous(memory_format=torch.channels_last)
        gradient = torch.randn(x.shape).bfloat16()
        mine, theirs = x.clone().requires_grad_(), x.double().requires_grad_()
        y = fused_norm.normalised(mine, bn, with_silu)
        z = exact(theirs)
        wanted = nn.functional.silu(z) if with_silu else z
        y.backward(gradient)
        wanted.backward(gradient.double())

        def near(a, b, share):
            self.assertLess(float((a.double() - b.double()).abs().max()), share * float(b.abs().max()))

        near(y, wanted, 0.005)
        near(mine.grad, theirs.grad, 0.01)
        near(bn.weight.grad, exact.weight.grad, 1e-4)
        near(bn.bias.grad, exact.bias.grad, 1e-4)
        near(bn.running_mean, exact.running_mean, 1e-5)
        near(bn.running_var, exact.running_var, 1e-5)
        self.assertEqual(int(bn.num_batches_tracked), 1)

    def test_equals_normalisation_and_silu(self):
        for channels in (8, 24, 64, 100):
            self.compare(channels, True, 0.5)

    def test_equals_normalisation_alone(self):
        self.compare(48, False, 0.5)

    def test_a_mean_far_above_the_deviation_costs_no_digits(self):
        self.compare(16, True, 200.0)

    def test_is_taken_by_convolutions_in_training_only(self):
        conv = Conv(3, 16, 3)
        x = torch.rand(2, 3, 8, 8).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", torch.bfloat16):
            self.assertIn("NormSilu", type(conv(x).grad_fn).__name__)
            self.assertNotIn("NormSilu", type(conv.eval()(x).grad_fn).__name__)
        self.assertNotIn("NormSilu", type(conv.train()(x).grad_fn).__name__)


if __name__ == "__main__":
    unittest.main()
