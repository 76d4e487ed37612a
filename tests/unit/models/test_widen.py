from __future__ import annotations

import unittest

import torch

from network import NetworkOptions, Yolo
from widen import WidenError, widened


def trained_in_appearance(options: NetworkOptions) -> Yolo:
    """Statistics and scales of normalisation as no fresh network has them, so that each must have been carried over."""
    torch.manual_seed(1)
    network = Yolo(options).eval()
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            for values in (module.running_var, module.weight.data):
                values.uniform_(0.5, 2.0)
            for values in (module.running_mean, module.bias.data):
                values.uniform_(-0.3, 0.3)
    return network


class Widen(unittest.TestCase):
    def heads_agree(self, **options) -> None:
        narrow = trained_in_appearance(NetworkOptions(width=0.125, **options))
        wide = widened(narrow.state_dict(), narrow.options, 0.25)
        x = torch.rand(1, 3, 64, 96)
        with torch.no_grad():
            for before, after in zip(narrow(x), wide(x)):
                torch.testing.assert_close(after, before, rtol=1e-4, atol=1e-4)

    def test_the_wider_network_gives_the_same_heads(self):
        self.heads_agree()

    def test_without_ghost_attention_and_fourth_layer_too(self):
        self.heads_agree(ghost=False, cbam=False, fourth_layer=False)

    def test_copies_of_a_channel_are_read_differently(self):
        narrow = trained_in_appearance(NetworkOptions(width=0.125))
        weight = widened(narrow.state_dict(), narrow.options, 0.25).down3.conv.weight
        self.assertGreater((weight[:, 0::2] - weight[:, 1::2]).abs().max(), 1e-3)
        self.assertGreater((weight[0::2] - weight[1::2]).abs().max(), 1e-3)

    def test_what_is_no_whole_multiple_is_refused(self):
        narrow = Yolo(NetworkOptions(width=0.25))
        with self.assertRaisesRegex(WidenError, "stem.conv.conv.weight: .* a whole number of times"):
            widened(narrow.state_dict(), narrow.options, 0.375)


if __name__ == "__main__":
    unittest.main()
