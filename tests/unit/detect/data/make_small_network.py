#!/usr/bin/python3
"""Writes small.onnx and small_outputs.bin: a small network of the detector's kind with random weights, and what PyTorch makes of an input.

Usage: make_small_network.py FOLDER. Needs python3-torch and python3-onnx. The network has every block of the shipped ones once: Focus,
convolutions with batch normalisation (left unfolded) and SiLU, ghost bottlenecks, an attention block (CBAM), spatial pyramid pooling,
nearest-neighbour enlargement, concatenations and heads. The input is not stored: see `test_input`, which the tests repeat.
"""

import json
import pathlib
import sys

import numpy as np
import onnx
import torch
from torch import nn
from torch.nn import functional as F

HEIGHT, WIDTH = 64, 96
ANCHORS = [[[6, 12], [9, 20], [14, 30]], [[20, 44], [34, 60], [60, 62]]]
STRIDES = [4, 8]


class Conv(nn.Module):
    def __init__(self, inputs, outputs, kernel=1, stride=1, groups=1, silu=True):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False)
        self.norm = nn.BatchNorm2d(outputs, eps=1e-3)
        self.activation = nn.SiLU() if silu else nn.Identity()

    def forward(self, x):
        return self.activation(self.norm(self.conv(x)))


class Ghost(nn.Module):
    """Half of the channels by a pointwise convolution, the other half made of them by a depthwise one."""

    def __init__(self, inputs, outputs, silu=True):
        super().__init__()
        self.primary = Conv(inputs, outputs // 2, silu=silu)
        self.cheap = Conv(outputs // 2, outputs // 2, 3, groups=outputs // 2, silu=silu)

    def forward(self, x):
        y = self.primary(x)
        return torch.cat((y, self.cheap(y)), 1)


class C3Ghost(nn.Module):
    def __init__(self, inputs, outputs):
        super().__init__()
        half = outputs // 2
        self.a, self.b, self.c = Conv(inputs, half), Conv(inputs, half), Conv(outputs, outputs)
        self.ghosts = nn.Sequential(Ghost(half, half // 2), Ghost(half // 2, half, silu=False))

    def forward(self, x):
        a = self.a(x)
        return self.c(torch.cat((a + self.ghosts(a), self.b(x)), 1))


class Cbam(nn.Module):
    def __init__(self, channels, hidden):
        super().__init__()
        self.first = nn.Conv2d(channels, hidden, 1)
        self.second = nn.Conv2d(hidden, channels, 1)
        self.spatial = nn.Conv2d(2, 1, 7, padding=3)

    def perceptron(self, x):
        return self.second(F.relu(self.first(x)))

    def forward(self, x):
        x = x * torch.sigmoid(self.perceptron(F.adaptive_avg_pool2d(x, 1)) + self.perceptron(F.adaptive_max_pool2d(x, 1)))
        pooled = torch.cat((x.mean(1, keepdim=True), x.max(1, keepdim=True)[0]), 1)
        return x * torch.sigmoid(self.spatial(pooled))


class Spp(nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.a, self.b = Conv(channels, channels // 2), Conv(2 * channels, channels)

    def forward(self, x):
        x = self.a(x)
        return self.b(torch.cat([x] + [F.max_pool2d(x, k, 1, k // 2) for k in (5, 9, 13)], 1))


class SmallNetwork(nn.Module):
    def __init__(self):
        super().__init__()
        self.stem = Conv(12, 8, 3)
        self.down4, self.stage4, self.attention4 = Conv(8, 16, 3, 2), C3Ghost(16, 16), Cbam(16, 2)
        self.down8, self.spp, self.stage8, self.attention8 = Conv(16, 32, 3, 2), Spp(32), C3Ghost(32, 32), Cbam(32, 2)
        self.lateral, self.merge = Conv(32, 16), C3Ghost(32, 16)
        self.heads = nn.ModuleList([nn.Conv2d(16, 18, 1), nn.Conv2d(32, 18, 1)])

    def forward(self, x):
        x = torch.cat((x[..., ::2, ::2], x[..., 1::2, ::2], x[..., ::2, 1::2], x[..., 1::2, 1::2]), 1)
        x4 = self.attention4(self.stage4(self.down4(self.stem(x))))
        x8 = self.attention8(self.stage8(self.spp(self.down8(x4))))
        y4 = self.merge(torch.cat((F.interpolate(self.lateral(x8), scale_factor=2.0, mode="nearest"), x4), 1))
        return self.heads[0](y4), self.heads[1](x8)


def randomise(network):
    """Statistics and biases that a trained network could have, so that a mistake in any of them shows."""
    for module in network.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.running_mean.normal_(0, 0.2)
            module.running_var.uniform_(0.3, 1.5)
            module.weight.data.uniform_(0.7, 1.5)
            module.bias.data.normal_(0, 0.3)
        elif isinstance(module, nn.Conv2d) and module.bias is not None:
            module.bias.data.normal_(0, 0.3)


def test_input():
    """In [0, 1], steps of 1/255 as in a photograph."""
    index = np.arange(3 * HEIGHT * WIDTH, dtype=np.uint64)
    return ((index * 2654435761 % 2**32 >> 16) % 256).astype(np.float32).reshape(1, 3, HEIGHT, WIDTH) / np.float32(255)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    torch.manual_seed(1)
    network = SmallNetwork().eval()
    with torch.no_grad():
        randomise(network)
        image = torch.from_numpy(test_input())
        outputs = [output.numpy().ravel() for output in network(image)]
        torch.onnx.export(network, image, folder / "small.onnx", opset_version=12, input_names=["images"], output_names=["stride4", "stride8"],
                          training=torch.onnx.TrainingMode.PRESERVE)
    model = onnx.load(folder / "small.onnx")
    onnx.helper.set_model_props(model, {"posed.name": json.dumps("small test network"), "posed.classes": json.dumps(["person"]),
                                        "posed.input": json.dumps([3, HEIGHT, WIDTH]), "posed.strides": json.dumps(STRIDES),
                                        "posed.anchors": json.dumps(ANCHORS)})
    onnx.save(model, folder / "small.onnx")
    np.concatenate(outputs).astype("<f4").tofile(folder / "small_outputs.bin")
    print(f"{sum(p.numel() for p in network.parameters())} parameters, outputs from {min(map(np.min, outputs)):.3g} to {max(map(np.max, outputs)):.3g}")


if __name__ == "__main__":
    main()
