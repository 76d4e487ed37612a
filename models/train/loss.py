"""The loss of the raw heads: CIoU of the boxes, binary cross entropy of objectness and classes.

Targets are matched as YOLOv5 does: an anchor is responsible for a box whose sides differ from its own by less than a factor of 4, in
the cell of the box's centre and in the two neighbours nearest to it. Otherwise than there, where two boxes claim a cell for the same
anchor it is that of the nearer centre: asked for both, it would learn a box between them.

Where an anchor has two boxes, the second one is asked for the person whose box overlaps that of the first most, if by enough and within
reach. Which of the two boxes is whose is left to them: that of both orders counts which costs less (Chu et al., "Detection in crowded
scenes: one proposal, multiple predictions", CVPR 2020, eq. 3). Where there is no such person, the second one is to find nobody.
"""
from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from boxes import CENTRE_REACH, complete_iou, decode_boxes, paired_iou

# Objectness of the finer layers counts for more: they have more cells with an object in them. Finest layer first.
LAYER_BALANCE = {3: (4.0, 1.0, 0.4), 4: (4.0, 2.0, 1.0, 0.4)}


@dataclass(frozen=True)
class LossWeights:
    box: float = 0.05
    objectness: float = 0.7
    classes: float = 0.3
    anchor_ratio: float = 4.0
    pair_overlap: float = 0.3  # intersection over union, from which on a second box of the anchor is asked for the other person


@dataclass(frozen=True)
class Matches:
    """Which cells of a layer are responsible for which targets; M of them."""

    image: Tensor
    anchor: Tensor
    row: Tensor
    column: Tensor
    target: Tensor  # its number

    def __len__(self) -> int:
        return len(self.target)

    def __getitem__(self, chosen: Tensor) -> Matches:
        return Matches(self.image[chosen], self.anchor[chosen], self.row[chosen], self.column[chosen], self.target[chosen])

    def boxes(self, targets: Tensor, number: Tensor) -> Tensor:
        """Targets by their number, as boxes: centre relative to the match's cell, size."""
        cell = torch.stack((self.column, self.row), 1)
        return torch.cat((targets[number, 2:4] - cell, targets[number, 4:6]), 1)


def match_targets(targets: Tensor, anchors: Tensor, height: int, width: int, ratio: float) -> Matches:
    """`targets`: T x 6 (image, class, centre x, centre y, width, height), in cells of this layer. `anchors`: A x 2, in cells."""
    count, layers = len(targets), len(anchors)
    anchor = torch.arange(layers, device=targets.device).view(-1, 1).expand(layers, count)
    number = torch.arange(count, device=targets.device).expand(layers, count)
    quotient = targets[None, :, 4:6] / anchors[:, None]
    fits = torch.maximum(quotient, 1 / quotient).amax(2) < ratio
    number, anchor = number[fits], anchor[fits]

    centre = targets[number, 2:4]
    size = centre.new_tensor([width, height])
    fraction, inverse = centre % 1, (size - centre) % 1
    left, up = ((fraction < 0.5) & (centre > 1)).T
    right, down = ((inverse < 0.5) & (size - centre > 1)).T
    choices = torch.stack((torch.ones_like(left), left, up, right, down))
    offsets = 0.5 * centre.new_tensor([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]])
    number = number[None].expand(5, -1)[choices]
    anchor = anchor[None].expand(5, -1)[choices]
    shift = offsets[:, None].expand(5, len(centre), 2)[choices]

    cell = (targets[number, 2:4] - shift).long()
    column, row = cell[:, 0].clamp(0, width - 1), cell[:, 1].clamp(0, height - 1)
    return Matches(targets[number, 0].long(), anchor, row, column, number)


def nearest_of_each_cell(matches: Matches, targets: Tensor, anchors: int, height: int, width: int) -> Matches:
    """Of all matches of one image, anchor and cell the one whose centre is nearest to the cell's middle."""
    place = ((matches.image * anchors + matches.anchor) * height + matches.row) * width + matches.column
    order = (matches.boxes(targets, matches.target)[:, :2] - 0.5).norm(dim=1).argsort(stable=True)
    order = order[place[order].argsort(stable=True)]
    is_first = torch.ones_like(order, dtype=torch.bool)
    is_first[1:] = place[order[1:]] != place[order[:-1]]
    return matches[order[is_first]]


def partners(targets: Tensor, least_overlap: float) -> Tensor:
    """Of each target the number of the other one of its image that overlaps it most, or -1 where none does by `least_overlap`."""
    if not len(targets):
        return targets.new_zeros(0, dtype=torch.long)
    overlap = paired_iou(targets[:, None, 2:], targets[None, :, 2:])
    overlap = overlap.masked_fill(targets[:, None, 0] != targets[None, :, 0], 0.0).fill_diagonal_(0.0)
    most, number = overlap.max(1)
    return torch.where(most >= least_overlap, number, torch.full_like(number, -1))


def in_reach(boxes: Tensor, anchors: Tensor, reach: float, ratio: float) -> Tensor:
    """Which boxes (centre relative to the cell, size) a box of that anchor can become, with some room left."""
    quotient = boxes[:, 2:] / anchors
    near = (boxes[:, :2] - 0.5).abs().amax(1) <= 0.95 * reach
    return near & (torch.maximum(quotient, 1 / quotient).amax(1) < ratio)


class DetectionLoss(nn.Module):
    """`anchors`: layers x A x 2 [pixels]."""

    def __init__(self, anchors: Tensor, strides: tuple[int, ...], classes: int, boxes_per_anchor: int = 1, weights: LossWeights = LossWeights()):
        super().__init__()
        self.register_buffer("anchors", anchors.float())
        self.strides, self.classes, self.boxes_per_anchor, self.weights = strides, classes, boxes_per_anchor, weights
        self.balance = LAYER_BALANCE[len(strides)]

    def assigned(self, chosen: Tensor, targets: Tensor, matches: Matches, anchors: Tensor, partner: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
        """Whether a match asks an anchor's box for somebody, the number of the target and the CIoU with it: each M x boxes. `chosen`: M x
        boxes x (5 + classes), the raw values of the matches' cells; `anchors` M x 2 [cells]; `partner` as of
        partners()."""
        own = matches.target
        first = decode_boxes(chosen[:, 0], anchors, CENTRE_REACH[0])
        everyone = torch.ones_like(own, dtype=torch.bool)
        if self.boxes_per_anchor == 1:
            return everyone[:, None], own[:, None], complete_iou(first, matches.boxes(targets, own))[:, None]
        second = decode_boxes(chosen[:, 1], anchors, CENTRE_REACH[1])
        other = partner[own]
        paired = other >= 0
        other = other.clamp(0)
        own_box, other_box = matches.boxes(targets, own), matches.boxes(targets, other)
        paired &= in_reach(other_box, anchors, CENTRE_REACH[1], self.weights.anchor_ratio)
        straight = complete_iou(first, own_box), complete_iou(second, other_box)
        crossed = complete_iou(first, other_box), complete_iou(second, own_box)
        with torch.no_grad():
            def cost(overlaps: tuple[Tensor, Tensor]) -> Tensor:
                return sum(1 - o + functional.binary_cross_entropy_with_logits(chosen[:, k, 4], o.clamp(0), reduction="none")
                           for k, o in enumerate(overlaps))

            swapped = paired & in_reach(other_box, anchors, CENTRE_REACH[0], self.weights.anchor_ratio) & (cost(crossed) < cost(straight))
        return (torch.stack((everyone, paired), 1), torch.where(swapped[:, None], torch.stack((other, own), 1), torch.stack((own, other), 1)),
                torch.where(swapped[:, None], torch.stack(crossed, 1), torch.stack(straight, 1)))

    def forward(self, heads: tuple[Tensor, ...], targets: Tensor) -> tuple[Tensor, dict[str, float]]:
        """`targets`: T x 6 (image in the batch, class, centre x, centre y, width, height) [pixels of the input]."""
        box_loss = obj_loss = class_loss = heads[0].new_zeros(())
        batch = heads[0].shape[0]
        # Overlaps are the same in all layers.
        partner = partners(targets, self.weights.pair_overlap) if self.boxes_per_anchor > 1 else None
        for head, stride, anchors, balance in zip(heads, self.strides, self.anchors, self.balance):
            _, _, height, width = head.shape
            values = head.float().view(batch, len(anchors), self.boxes_per_anchor, 5 + self.classes, height, width).permute(0, 1, 4, 5, 2, 3)
            wanted = torch.zeros(values.shape[:5], device=head.device)
            in_cells = targets.clone()
            in_cells[:, 2:] /= stride
            matches = match_targets(in_cells, anchors / stride, height, width, self.weights.anchor_ratio)
            matches = nearest_of_each_cell(matches, in_cells, len(anchors), height, width)
            if len(matches):
                place = matches.image, matches.anchor, matches.row, matches.column
                chosen = values[place]
                asked, target, overlap = self.assigned(chosen, in_cells, matches, (anchors / stride)[matches.anchor], partner)
                box_loss = box_loss + (1 - overlap[asked]).mean()
                wanted[place] = overlap.detach().clamp(0) * asked
                if self.classes > 1:
                    one_hot = functional.one_hot(targets[target[asked], 1].long(), self.classes).float()
                    class_loss = class_loss + functional.binary_cross_entropy_with_logits(chosen[..., 5:][asked], one_hot)
            obj_loss = obj_loss + balance * self.boxes_per_anchor * functional.binary_cross_entropy_with_logits(values[..., 4], wanted)
        w = self.weights
        total = batch * (w.box * box_loss + w.objectness * obj_loss + w.classes * class_loss)
        return total, {"box": float(box_loss), "objectness": float(obj_loss), "classes": float(class_loss)}
