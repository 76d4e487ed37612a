"""The loss of the raw heads: CIoU of the boxes, binary cross entropy of objectness and classes.

Targets are matched as YOLOv5 does: an anchor is responsible for a box whose sides differ from its own by less than a factor of 4, in
the cell of the box's centre and in the two neighbours nearest to it. Otherwise than there, where two boxes claim a cell for the same
anchor it is that of the nearer centre: asked for both, it would learn a box between them.
"""
from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from boxes import complete_iou

# Objectness of the finer layers counts for more: they have more cells with an object in them. Finest layer first.
LAYER_BALANCE = {3: (4.0, 1.0, 0.4), 4: (4.0, 2.0, 1.0, 0.4)}


@dataclass(frozen=True)
class LossWeights:
    box: float = 0.05
    objectness: float = 0.7
    classes: float = 0.3
    anchor_ratio: float = 4.0


def match_targets(targets: Tensor, anchors: Tensor, height: int, width: int, ratio: float):
    """`targets`: T x 6 (image, class, centre x, centre y, width, height), in cells of this layer. `anchors`: A x 2, in cells.

    Returns, for each match: image, anchor, row, column, class and the box (centre relative to the cell, size).
    """
    count, layers = len(targets), len(anchors)
    anchor = torch.arange(layers, device=targets.device).view(-1, 1).expand(layers, count)
    spread = targets[None].expand(layers, count, 6)
    quotient = spread[..., 4:6] / anchors[:, None]
    fits = torch.maximum(quotient, 1 / quotient).amax(2) < ratio
    spread, anchor = spread[fits], anchor[fits]

    centre = spread[:, 2:4]
    size = centre.new_tensor([width, height])
    fraction, inverse = centre % 1, (size - centre) % 1
    left, up = ((fraction < 0.5) & (centre > 1)).T
    right, down = ((inverse < 0.5) & (size - centre > 1)).T
    choices = torch.stack((torch.ones_like(left), left, up, right, down))
    offsets = 0.5 * centre.new_tensor([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]])
    spread = spread[None].expand(5, -1, -1)[choices]
    anchor = anchor[None].expand(5, -1)[choices]
    shift = offsets[:, None].expand(5, len(centre), 2)[choices]

    cell = (spread[:, 2:4] - shift).long()
    column, row = cell[:, 0].clamp(0, width - 1), cell[:, 1].clamp(0, height - 1)
    box = torch.cat((spread[:, 2:4] - torch.stack((column, row), 1), spread[:, 4:6]), 1)
    return spread[:, 0].long(), anchor, row, column, spread[:, 1].long(), box


def nearest_of_each_cell(match: tuple[Tensor, ...], anchors: int, height: int, width: int) -> tuple[Tensor, ...]:
    """Of all matches (as match_targets gives them) of one image, anchor and cell the one whose centre is nearest to the cell's middle."""
    image, anchor, row, column, _, box = match
    place = ((image * anchors + anchor) * height + row) * width + column
    order = (box[:, :2] - 0.5).norm(dim=1).argsort(stable=True)
    order = order[place[order].argsort(stable=True)]
    is_first = torch.ones_like(order, dtype=torch.bool)
    is_first[1:] = place[order[1:]] != place[order[:-1]]
    kept = order[is_first]
    return tuple(m[kept] for m in match)


class DetectionLoss(nn.Module):
    """`anchors`: layers x A x 2 [pixels]."""

    def __init__(self, anchors: Tensor, strides: tuple[int, ...], classes: int, weights: LossWeights = LossWeights()):
        super().__init__()
        self.register_buffer("anchors", anchors.float())
        self.strides, self.classes, self.weights = strides, classes, weights
        self.balance = LAYER_BALANCE[len(strides)]

    def forward(self, heads: tuple[Tensor, ...], targets: Tensor) -> tuple[Tensor, dict[str, float]]:
        """`targets`: T x 6 (image in the batch, class, centre x, centre y, width, height) [pixels of the input]."""
        box_loss = obj_loss = class_loss = heads[0].new_zeros(())
        batch = heads[0].shape[0]
        for head, stride, anchors, balance in zip(heads, self.strides, self.anchors, self.balance):
            _, _, height, width = head.shape
            values = head.float().view(batch, len(anchors), 5 + self.classes, height, width).permute(0, 1, 3, 4, 2)
            wanted = torch.zeros(values.shape[:4], device=head.device)
            in_cells = targets.clone()
            in_cells[:, 2:] /= stride
            match = match_targets(in_cells, anchors / stride, height, width, self.weights.anchor_ratio)
            image, anchor, row, column, label, box = nearest_of_each_cell(match, len(anchors), height, width)
            if len(image):
                chosen = values[image, anchor, row, column]
                centre = chosen[:, :2].sigmoid() * 2 - 0.5
                size = (chosen[:, 2:4].sigmoid() * 2) ** 2 * (anchors / stride)[anchor]
                overlap = complete_iou(torch.cat((centre, size), 1), box)
                box_loss = box_loss + (1 - overlap).mean()
                wanted[image, anchor, row, column] = overlap.detach().clamp(0)
                if self.classes > 1:
                    one_hot = functional.one_hot(label, self.classes).float()
                    class_loss = class_loss + functional.binary_cross_entropy_with_logits(chosen[:, 5:], one_hot)
            obj_loss = obj_loss + balance * functional.binary_cross_entropy_with_logits(values[..., 4], wanted)
        w = self.weights
        total = batch * (w.box * box_loss + w.objectness * obj_loss + w.classes * class_loss)
        return total, {"box": float(box_loss), "objectness": float(obj_loss), "classes": float(class_loss)}
