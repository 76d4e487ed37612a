"""The detector's network: YOLOv5 v5.0 with C3Ghost, CBAM and a fourth detection layer as options.

Gan et al. 2024, "Robust visual SLAM algorithm based on target detection and clustering in dynamic scenarios", section 3.1. Ghost
modules: Han et al., "GhostNet", CVPR 2020. CBAM: Woo et al., ECCV 2018. Tensors are N x C x H x W.
"""
from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

import fused_norm
from boxes import CENTRE_REACH

STRIDES_4 = (4, 8, 16, 32)
STRIDES_3 = (8, 16, 32)
ANCHORS_PER_LAYER = 3
BOX_VALUES = 5  # x, y, width, height, objectness


@dataclass(frozen=True)
class NetworkOptions:
    """Which of the paper's variants, and how large."""

    width: float = 0.5
    depth: float = 0.33
    classes: int = 1
    ghost: bool = True
    cbam: bool = True
    fourth_layer: bool = True
    boxes_per_anchor: int = 1  # 2: the second one is of somebody who overlaps the first one's person

    @property
    def strides(self) -> tuple[int, ...]:
        return STRIDES_4 if self.fourth_layer else STRIDES_3

    def to_dict(self) -> dict:
        return asdict(self)


class Silu(nn.SiLU):
    """x * sigmoid(x). In bfloat16 PyTorch's own is several times slower on a processor than in float, so it is taken in float there."""

    def forward(self, x: Tensor) -> Tensor:
        if x.dtype == torch.bfloat16:
            return functional.silu(x.float()).to(x.dtype)
        return super().forward(x)


class Conv(nn.Module):
    """Convolution, batch normalisation and SiLU; the size is kept but for the stride."""

    def __init__(self, inputs: int, outputs: int, kernel: int = 1, stride: int = 1, groups: int = 1, act: bool = True):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False)
        self.bn = nn.BatchNorm2d(outputs, eps=1e-3, momentum=0.03)
        self.act = Silu(inplace=True) if act else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        x = self.conv(x)
        if self.training and fused_norm.is_for(x):
            return fused_norm.normalised(x, self.bn, isinstance(self.act, Silu))
        return self.act(self.bn(x))


class Bottleneck(nn.Module):
    def __init__(self, channels: int, shortcut: bool):
        super().__init__()
        self.reduce = Conv(channels, channels)
        self.expand = Conv(channels, channels, 3)
        self.shortcut = shortcut

    def forward(self, x: Tensor) -> Tensor:
        y = self.expand(self.reduce(x))
        return x + y if self.shortcut else y


class Ghost(nn.Module):
    """Half of the outputs by convolution, the other half by a cheap 3 x 3 convolution of each of those."""

    def __init__(self, inputs: int, outputs: int, act: bool = True):
        super().__init__()
        half = outputs // 2
        self.primary = Conv(inputs, half, act=act)
        self.cheap = Conv(half, half, 3, groups=half, act=act)

    def forward(self, x: Tensor) -> Tensor:
        y = self.primary(x)
        return torch.cat((y, self.cheap(y)), 1)


class GhostBottleneck(nn.Module):
    def __init__(self, channels: int):
        super().__init__()
        half = channels // 2
        self.reduce = Ghost(channels, half)
        self.expand = Ghost(half, channels, act=False)

    def forward(self, x: Tensor) -> Tensor:
        return x + self.expand(self.reduce(x))


class C3(nn.Module):
    """Cross-stage partial bottleneck with three convolutions."""

    def __init__(self, inputs: int, outputs: int, count: int, shortcut: bool, ghost: bool):
        super().__init__()
        half = outputs // 2
        self.main = Conv(inputs, half)
        self.side = Conv(inputs, half)
        self.join = Conv(2 * half, outputs)
        self.blocks = nn.Sequential(*(GhostBottleneck(half) if ghost else Bottleneck(half, shortcut) for _ in range(count)))

    def forward(self, x: Tensor) -> Tensor:
        return self.join(torch.cat((self.blocks(self.main(x)), self.side(x)), 1))


class Spp(nn.Module):
    """Spatial pyramid pooling."""

    def __init__(self, channels: int):
        super().__init__()
        half = channels // 2
        self.reduce = Conv(channels, half)
        self.join = Conv(4 * half, channels)
        self.pools = nn.ModuleList(nn.MaxPool2d(k, 1, k // 2) for k in (5, 9, 13))

    def forward(self, x: Tensor) -> Tensor:
        x = self.reduce(x)
        return self.join(torch.cat([x] + [pool(x) for pool in self.pools], 1))


class Focus(nn.Module):
    """Every second pixel of every second row becomes a channel: four images of half the size, then a convolution."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.conv = Conv(4 * inputs, outputs, 3)

    def forward(self, x: Tensor) -> Tensor:
        return self.conv(torch.cat((x[..., ::2, ::2], x[..., 1::2, ::2], x[..., ::2, 1::2], x[..., 1::2, 1::2]), 1))


class Cbam(nn.Module):
    """Convolutional block attention: channels first, then places. The reduction of 16 leaves at least one hidden value."""

    def __init__(self, channels: int, reduction: int = 16):
        super().__init__()
        hidden = max(1, channels // reduction)
        self.squeeze = nn.Conv2d(channels, hidden, 1, bias=False)
        self.excite = nn.Conv2d(hidden, channels, 1, bias=False)
        self.place = nn.Conv2d(2, 1, 7, padding=3, bias=False)

    def perceptron(self, v: Tensor) -> Tensor:
        return self.excite(functional.relu(self.squeeze(v)))

    def forward(self, x: Tensor) -> Tensor:
        mean, peak = functional.adaptive_avg_pool2d(x, 1), functional.adaptive_max_pool2d(x, 1)
        x = x * torch.sigmoid(self.perceptron(mean) + self.perceptron(peak))
        summary = torch.cat((x.mean(1, keepdim=True), x.max(1, keepdim=True)[0]), 1)
        return x * torch.sigmoid(self.place(summary))


class Yolo(nn.Module):
    """`forward` gives the raw heads, one N x (3 * boxes_per_anchor * (5 + classes)) x H / stride x W / stride for each stride, finest
    first; an anchor's boxes stand beside each other.

    Two boxes an anchor are those of Chu et al., "Detection in crowded scenes: one proposal, multiple predictions", CVPR 2020."""

    def __init__(self, options: NetworkOptions = NetworkOptions()):
        super().__init__()
        self.options = options
        ghost, fourth = options.ghost, options.fourth_layer

        def channels(full: int) -> int:
            return max(8, math.ceil(full * options.width / 8) * 8)

        def count(full: int) -> int:
            return max(1, round(full * options.depth))

        c1, c2, c3, c4, c5 = (channels(64 << i) for i in range(5))
        self.stem = Focus(3, c1)
        self.down2, self.stage2 = Conv(c1, c2, 3, 2), C3(c2, c2, count(3), True, ghost)
        self.down3, self.stage3 = Conv(c2, c3, 3, 2), C3(c3, c3, count(9), True, ghost)
        self.down4, self.stage4 = Conv(c3, c4, 3, 2), C3(c4, c4, count(9), True, ghost)
        self.down5 = Conv(c4, c5, 3, 2)
        self.stage5 = nn.Sequential(Spp(c5), C3(c5, c5, count(3), False, ghost))
        self.attention = nn.ModuleList(Cbam(c) if options.cbam else nn.Identity() for c in (c2, c3, c4, c5))
        self.up = nn.Upsample(scale_factor=2, mode="nearest")

        self.lateral5, self.top4 = Conv(c5, c4), C3(2 * c4, c4, count(3), False, ghost)
        self.lateral4, self.top3 = Conv(c4, c3), C3(2 * c3, c3, count(3), False, ghost)
        if fourth:
            self.lateral3, self.top2 = Conv(c3, c2), C3(2 * c2, c2, count(3), False, ghost)
            self.bottom2, self.out3 = Conv(c2, c2, 3, 2), C3(2 * c2, c3, count(3), False, ghost)
        self.bottom3, self.out4 = Conv(c3, c3, 3, 2), C3(2 * c3, c4, count(3), False, ghost)
        self.bottom4, self.out5 = Conv(c4, c4, 3, 2), C3(2 * c4, c5, count(3), False, ghost)

        values = ANCHORS_PER_LAYER * options.boxes_per_anchor * (BOX_VALUES + options.classes)
        heads = ([c2] if fourth else []) + [c3, c4, c5]
        self.heads = nn.ModuleList(nn.Conv2d(c, values, 1) for c in heads)
        self._expect_few_objects()

    def _expect_few_objects(self) -> None:
        """Objectness begins at what 8 objects in an image of 640 x 640 would give, so that training need not learn it first."""
        for head, stride in zip(self.heads, self.options.strides):
            bias = head.bias.detach().view(ANCHORS_PER_LAYER * self.options.boxes_per_anchor, -1)
            bias[:, 4] = math.log(8 / (640 / stride) ** 2)
            bias[:, 5:] = math.log(0.6 / max(self.options.classes - 0.99, 0.01))
            head.bias = nn.Parameter(bias.reshape(-1))

    def forward(self, x: Tensor) -> tuple[Tensor, ...]:
        x = self.stem(x)
        p2 = self.attention[0](self.stage2(self.down2(x)))
        p3 = self.attention[1](self.stage3(self.down3(p2)))
        p4 = self.attention[2](self.stage4(self.down4(p3)))
        p5 = self.attention[3](self.stage5(self.down5(p4)))
        l5 = self.lateral5(p5)
        l4 = self.lateral4(self.top4(torch.cat((self.up(l5), p4), 1)))
        o3 = self.top3(torch.cat((self.up(l4), p3), 1))
        outputs = []
        if self.options.fourth_layer:
            l3 = self.lateral3(o3)
            o2 = self.top2(torch.cat((self.up(l3), p2), 1))
            outputs.append(o2)
            o3 = self.out3(torch.cat((self.bottom2(o2), l3), 1))
        o4 = self.out4(torch.cat((self.bottom3(o3), l4), 1))
        o5 = self.out5(torch.cat((self.bottom4(o4), l5), 1))
        outputs += [o3, o4, o5]
        return tuple(head(o) for head, o in zip(self.heads, outputs))


def with_second_boxes(state: dict[str, Tensor], had: NetworkOptions, wanted: NetworkOptions) -> dict[str, Tensor]:
    """The weights of a network of `had`, for one of `wanted` that may have a second box an anchor: it begins about where the first one is,
    and hardly believes it."""
    if had.boxes_per_anchor == wanted.boxes_per_anchor or wanted.boxes_per_anchor == 1:
        return state
    state = dict(state)
    values = BOX_VALUES + had.classes
    for name in [n for n in state if n.startswith("heads.")]:
        first = state[name].float().reshape(ANCHORS_PER_LAYER, values, -1)
        second = first.clone()
        second[:, :2] *= CENTRE_REACH[0] / CENTRE_REACH[1]
        second[:, 4] *= 0.5
        if name.endswith("bias"):
            second[:, 4] -= 2.0
        state[name] = torch.stack((first, second), 1).reshape(-1, *state[name].shape[1:])
    return state


def parameter_count(network: nn.Module) -> int:
    return sum(p.numel() for p in network.parameters())
